"""Published means, each with the settings that it holds for."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from sweep.design.design import Design, expand
from sweep.errors import ChoiceError, SpecError
from sweep.spec.recorded import Column
from sweep.spec.settings import Value
from sweep.spec.strict_yaml import read_document
from sweep.spec.study import Study, read_study
from sweep.tables.choosing import Chooser
from sweep.web.protocol import Reply


@cache
def published(
    model: str, preset: str, experiments: Path
) -> tuple[tuple[str, Reply], ...]:
    """Published means of this model and preset, each with its metric: value, where,
    says, frame, half and settings. With `half` it is a mean over the last half.

    They come from each published.yaml in `experiments`. A file that is missing or
    cannot be read gives none. `settings` has every setting of the points that the claim
    is about: the number holds for these values only. A setting is None where no value
    stands for it: these points differ in it, or it is a map of their spec's own.
    """
    found = []
    for file in sorted(experiments.glob("*/published.yaml")):
        if not _names(file.parent, model):
            continue
        try:
            found += list(_numbers(file, model, preset))
        except (SpecError, ChoiceError):
            continue
    return tuple(found)


def _names(folder: Path, model: str) -> bool:
    """Whether a spec in a folder may be of a model. Its name in a text is found at
    once, and to read all documents takes a second.
    """
    return any(
        model in _text(file)
        for file in folder.glob("*.yaml")
        if file.name != "published.yaml"
    )


@cache
def _text(file: Path) -> str:
    return file.read_text("utf-8", errors="replace") if file.is_file() else ""


def _numbers(file: Path, model: str, preset: str) -> Iterator[tuple[str, Reply]]:
    for claim in _content(file).get("claims", []):
        measure, expected = claim.get("measure", {}), claim.get("expect", {})
        if "mean" not in measure or "value" not in expected:
            continue
        study = _study(file.parent / f"{claim['spec']}.yaml")
        if study is None or (study.model, study.preset) != (model, preset):
            continue
        yield (
            Column.read(measure["mean"]).metric,
            {
                "value": expected["value"],
                "where": str(claim["where"]),
                "says": str(claim["says"]),
                "frame": measure.get("frame"),
                "half": Column.read(measure["mean"]).half,
                "settings": _settings(study, measure.get("for", {})),
            },
        )


def _settings(study: Study, chosen: Mapping[str, Any]) -> dict[str, Value | None]:
    """The settings of the points of a study that have those that are `chosen`."""
    design = _design(study)
    points = Chooser(design.base | design.columns, design.n_points).having(chosen)
    varied = {
        name: set(column[points].tolist()) for name, column in design.columns.items()
    }
    one = {name: values.pop() for name, values in varied.items() if _one(values)}
    settings = {**design.base, **{name: one.get(name) for name in varied}}
    return settings | ({"map": None} if settings["map"] in study.maps else {})


def _one(values: set[Any]) -> bool:
    return len(values) == 1


@cache
def _design(study: Study) -> Design:
    return expand(study)


@cache
def _study(file: Path) -> Study | None:
    return read_study(read_document(file)) if file.exists() else None


@cache
def _content(file: Path) -> Mapping[str, Any]:
    content: Mapping[str, Any] = read_document(file).value
    return content
