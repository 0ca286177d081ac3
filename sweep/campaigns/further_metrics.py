"""The metrics requested of `sweep measure` that a study does not record."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from kernels.catalogue import Catalogue
from sweep.errors import ChoiceError
from sweep.own_code import FILE, OwnCatalogue, with_files
from sweep.spec import parse_document, with_metrics
from sweep.store import expressions, is_ours
from sweep.tables import StoredStudy, StoredTrial, check_recorded
from sweep.text import unknown


class FurtherMetrics:
    """Requested metrics and expressions that a study does not record.

    Raises ChoiceError for an unknown metric, and for an expression with a name in use.
    Raises CodeError for code that cannot be used or may not run.

    Attributes
    ----------
    metrics : list of str
        Names of metrics.
    derive : dict of str
        Expressions of derived metrics, by name.
    """

    def __init__(self, study: StoredStudy, requested: Sequence[str]) -> None:
        self.study = study
        recorded = set(study.metrics)
        derive = [text.partition("=") for text in requested if "=" in text]
        plain = [text for text in requested if "=" not in text]
        files = [FILE.fullmatch(text) for text in plain]
        self._files = [(Path(match["path"]), match["name"]) for match in files if match]
        self._catalogues = dict[str, Catalogue]()
        self._written = dict[str, str]()
        catalogue = self.catalogue(study.provenance)
        named = [text for text in plain if not FILE.fullmatch(text)]
        names = dict.fromkeys([*named, *self._written])
        self.metrics = [name for name in names if name not in recorded]
        wrong = [
            unknown("metric", name, catalogue.metrics)
            for name in self.metrics
            if name not in catalogue.metrics
        ]
        if wrong:
            message = f"{'; '.join(wrong)}; `sweep metrics` lists them"
            raise ChoiceError(message, study.name)
        texts = {name.strip(): text.strip() for name, _, text in derive}
        known_texts = expressions(study.store.schema("trials")) if derive else {}
        self.derive = {
            name: text
            for name, text in texts.items()
            if name not in recorded or known_texts.get(name) != text
        }
        if taken := self.derive.keys() & recorded:
            message = f"{min(taken)} is recorded already: choose another name"
            raise ChoiceError(message, study.name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all metrics, measured and derived."""
        return (*self.metrics, *self.derive)

    def catalogue(self, origin: Mapping[str, Any]) -> Catalogue:
        """Return the catalogue for trials of an origin, with the requested files."""
        sha = str(origin["own"]["sha"]) if "own" in origin else ""
        if sha not in self._catalogues:
            catalogue = self.study.running(origin)
            self._catalogues[sha] = (
                self._joined(catalogue, origin) if self._files else catalogue
            )
        return self._catalogues[sha]

    def record(self, stored: StoredTrial) -> dict[str, Any]:
        """Return the `record` section of a stored trial with the further metrics.

        Raises ChoiceError if the model of the trial does not support the metrics.
        """
        catalogue = self.catalogue(stored.provenance)
        before = stored.record
        metrics = dict.fromkeys([*stored.metrics, *self.metrics])
        derive = {**stored.derive, **self.derive}
        record = (
            before | {"metrics": [*metrics]} | ({"derive": derive} if derive else {})
        )
        check_recorded(self.study.name, catalogue, stored, record)
        return record

    def spec(self) -> str:
        """Return the text of the last launched spec, with the further metrics."""
        origin = self.study.provenance
        usual = self.catalogue(origin).models[origin["model"]].metrics
        written = [self._written.get(name, name) for name in self.metrics]
        return with_metrics(self.study.spec, usual, written, self.derive)

    def recorded(self, spec: str) -> dict[str, Any]:
        """Return the further metrics in the text of a spec, by key of `record`."""
        record = parse_document(spec, Path("spec.yaml")).value["record"]
        keys = [("metrics", self.metrics), ("derive", self.derive)]
        return {key: record[key] for key, some in keys if some}

    def _joined(self, catalogue: Catalogue, origin: Mapping[str, Any]) -> OwnCatalogue:
        """Return a catalogue with the files, and note the names of metrics in files."""
        if "own" in origin and not is_ours(origin):
            message = (
                "another user has launched the study with custom code, to which your"
                " files cannot be added: launch the study yourself, with the metric in"
                " the spec"
            )
            raise ChoiceError(message, self.study.name)
        code = catalogue.code if isinstance(catalogue, OwnCatalogue) else None
        spec = Path(str(origin.get("spec_path", "")))
        joined, origins = with_files(code, spec, [path for path, _ in self._files])
        for file, (_, metric) in zip(origins, self._files, strict=True):
            offers = [
                name
                for (kind, name), source in joined.origins.items()
                if kind == "metrics" and source == file
            ]
            if not offers or (metric and metric not in offers):
                message = unknown(f"metric of {file}", metric or "METRICS", offers)
                raise ChoiceError(message, self.study.name)
            for name in [metric] if metric else offers:
                self._written[name] = joined.written("metrics", name)
        return joined
