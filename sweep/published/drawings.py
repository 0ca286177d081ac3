"""The figures of a publication: drawn only when what they depend on has changed."""

import hashlib
import json
from collections.abc import Mapping
from functools import cache, cached_property
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from kernels.identity import kernels_sha
from sweep.figures import STYLE, save, saved_about
from sweep.published.claims import Publication
from sweep.spec.layout import FIGURES
from sweep.tables.stored_study import StoredStudy


class FigureFile:
    """One figure of a publication, drawn below `root` from its studies that are
    `stored`.

    `results` is the folder that the user has named, which `root` is or lies in.
    """

    def __init__(
        self,
        publication: Publication,
        name: str,
        stored: Mapping[str, StoredStudy],
        root: Path,
        watermark: str,
        results: Path,
    ) -> None:
        self.publication = publication
        self.name = name
        self.drawing = publication.drawings[name]
        self.studies = {
            spec: stored[spec] for spec in self.drawing.specs if spec in stored
        }
        self.results = results
        # Without the endings of its two files.
        self.path = root / FIGURES / publication.name / name
        self.watermark = watermark

    @property
    def possible(self) -> bool:
        """Whether all studies that it needs are there."""
        return len(self.studies) == len(self.drawing.specs)

    def current(self) -> bool:
        """Whether the files are there and were drawn from what is stored now."""
        return (
            self.possible
            and saved_about(self.path).get("Inputs") == self.about["Inputs"]
        )

    def draw(self) -> None:
        """Draw and save it; whatever the study's function raises is raised."""
        figure = self.drawing.draw(self.studies)
        if not isinstance(figure, Figure):
            raise TypeError(
                "its function must return a figure of matplotlib, not"
                f" {type(figure).__name__}"
            )
        save(figure, self.path, self.about, self.watermark, below=self.results)

    @cached_property
    def about(self) -> dict[str, str]:
        """What the files say of themselves; `Inputs` hashes what they depend on."""
        done = {study.name: _done(study) for study in self.studies.values()}
        specs = [study.spec for study in self.studies.values()]
        sources = [
            path.read_text(encoding="utf-8")
            for path in sorted(self.publication.folder.glob("*.py"))
        ]
        inputs = [
            done,
            specs,
            kernels_sha(),
            sources,
            _house_sources(),
            matplotlib.__version__,
            self.watermark,
        ]
        return {
            "Study": ", ".join(done),
            "Spec hash": ", ".join(_hash(spec)[:16] for spec in specs),
            "kernels_sha": kernels_sha(),
            "Trials": ", ".join(str(len(trials)) for trials in done.values()),
            "Inputs": _hash(json.dumps(inputs)),
        }


@cache
def _house_sources() -> list[str]:
    """The texts of what figures share: the style, the pieces, and the estimates."""
    shared = [
        STYLE,
        *sorted(STYLE.parent.glob("*.py")),
        *sorted((STYLE.parent.parent / "analysis").glob("*.py")),
    ]
    return [path.read_text(encoding="utf-8") for path in shared]


def _done(study: StoredStudy) -> list[str]:
    statuses = study.store.trial_ids()
    return [
        trial
        for trial in study.plan["trial_id"].to_pylist()
        if statuses.get(trial) == "done"
    ]


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
