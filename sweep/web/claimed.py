"""Published means, with the parameters of the points."""

from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from sweep.design import Design, expand
from sweep.errors import ChoiceError, SpecError
from sweep.spec import Column, Study, Value, read_document, read_study
from sweep.tables import Chooser
from sweep.web.protocol import Reply


@cache
def published(
    model: str, preset: str, experiments: Path
) -> tuple[tuple[str, Reply], ...]:
    """Return published means of a model and preset, with their metrics.

    The means are in each published.yaml in `experiments`. A file that is missing or
    cannot be read gives no means.

    Parameters
    ----------
    model : str
        Name of the model.
    preset : str
        Name of the preset.
    experiments : Path
        Folder of studies, with one folder per publication.

    Returns
    -------
    tuple of (str, dict)
        The metric, and ``value``, ``where``, ``says``, ``frame``, ``half`` and
        ``settings``. With ``half`` the mean is over the second half of each trial.
        ``settings`` has the parameters of the points of the claim: the number holds
        for these values only. A parameter is None if the points differ in the
        parameter, or for a custom map of the spec.
    """
    means = []
    for file in sorted(experiments.glob("*/published.yaml")):
        if not _names(file.parent, model):
            continue
        try:
            means += list(_numbers(file, model, preset))
        except (SpecError, ChoiceError):
            continue
    return tuple(means)


def _names(folder: Path, model: str) -> bool:
    """Return whether a folder may have a spec of a model.

    A search for the name in the texts is immediate; reading all specs takes a second.
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
        measure = claim.get("measure", {})
        expected = claim.get("expect", {})
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
    """Return the parameters of the points of a study that have the `chosen` values."""
    design = _design(study)
    points = Chooser(design.base | design.columns, design.n_points).having(chosen)
    varied = {
        name: set(column[points].tolist()) for name, column in design.columns.items()
    }
    constant = {
        name: values.pop() for name, values in varied.items() if len(values) == 1
    }
    settings = {**design.base, **{name: constant.get(name) for name in varied}}
    return settings | ({"map": None} if settings["map"] in study.maps else {})


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
