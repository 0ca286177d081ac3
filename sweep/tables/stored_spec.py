"""A stored trial, read as a spec.

The row of the trial may be untrusted. So the row is checked like a spec before a kernel
runs.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kernels.catalogue import Catalogue
from kernels.settings import Actuation, Breakdowns, Medium, Sensing
from sweep.design import TRIAL_ID, expand
from sweep.errors import ChoiceError, SpecError, StoreError
from sweep.spec import (
    MOST_TRIALS,
    Document,
    Entry,
    OwnMap,
    Place,
    Study,
    Value,
    parse_document,
    read_fixed,
    read_study,
    sections,
    settings_of,
    spec_parts,
    written,
)
from sweep.tables.trial_rows import StoredTrial

LATER = (
    *(*Sensing._fields, *Actuation._fields, *Breakdowns._fields),
    *("start_distance", "obstacle_speed", "next_goals", "goals_repeat"),
    *Medium._fields,
)
"""Parameters that trials before 0.17 lack; the values are from the preset."""


def command_of(spec: str) -> str:
    """Return the command that runs a stored spec and prints the report."""
    try:
        root = parse_document(spec, Path("stored spec"))
    except SpecError:  # a store may be untrusted
        return "launch"
    if not isinstance(root.value, dict):
        return "launch"
    with_strategy = [section for section in sections().values() if section.strategy]
    commands = (section.command for section in with_strategy if section.is_in(root))
    return next(commands, "launch")


def check_recorded(
    study: str, catalogue: Catalogue, stored: StoredTrial, record: Mapping[str, Any]
) -> None:
    """Raise ChoiceError if the model of a stored trial cannot record something.

    Parameters
    ----------
    study : str
        The study of the trial, for errors.
    catalogue : Catalogue
        The models, metrics, maps and more by name.
    stored : StoredTrial
    record : mapping
        The section `record` of a spec.
    """
    model = {name: stored.row[name] for name in ("model", "preset")}
    spec = model | {"study": "stored", "replicates": 1, "record": record}
    try:
        read_study(Entry(_Row(Path("trials.parquet"), ""), (), spec), catalogue)
    except SpecError as error:
        raise ChoiceError(str(error), study) from None


@dataclass(frozen=True)
class _Row(Document):
    """A row instead of a YAML document, without lines for errors."""

    def error_in_line(self, _line: int, message: str, _place: Place = ()) -> SpecError:
        return SpecError(message)


def accepted(
    study: str,
    catalogue: Catalogue,
    stored: StoredTrial,
    maps: Mapping[str, OwnMap],
    record: Mapping[str, Any],
) -> tuple[Study, dict[str, Value]]:
    """Return a study of one point that launches a stored trial, and its parameters.

    Values are bitwise identical to the row.

    Parameters
    ----------
    study : str
        The study of the trial, for errors.
    catalogue : Catalogue
        The models, metrics, maps and more by name.
    stored : StoredTrial
    maps : mapping
        The maps in the plan of the study, by name.
    record : mapping
        The section `record` of the spec.

    Returns
    -------
    tuple of Study and dict
        The study, and the values of all parameters by name.

    Raises
    ------
    StoreError
        If no launch can have written the row. The error has the trial, the column, the
        value and the allowed values.
    """
    try:
        return _accepted(catalogue, stored, maps, record)
    except SpecError as error:
        trial = stored.row["trial_id"]
        message = "cannot be run again, because no launch accepts the stored row"
        raise StoreError(f"trial {trial} {message}: {error}", study) from None


def _accepted(
    catalogue: Catalogue,
    stored: StoredTrial,
    maps: Mapping[str, OwnMap],
    record: Mapping[str, Any],
) -> tuple[Study, dict[str, Value]]:
    row = stored.row
    document = _Row(Path("trials.parquet"), "")

    def cell(name: str) -> Entry:
        return Entry(document, (name,), row.get(name))

    if not TRIAL_ID.fullmatch(cell("trial_id").text()):
        raise cell("trial_id").expected("24 hexadecimal digits")
    cell("status").text()
    if row.get("error"):
        cell("error").text()
    spec = _spec(cell) | {"record": record}
    study = read_study(Entry(document, (), spec), catalogue)
    settings = settings_of(study.model, catalogue).of_study(maps)
    values = {
        name: row.get(name)
        for name, setting in settings.items()
        if row.get(name) is not None or not (name in LATER or setting.spread_of)
    }
    fixed = read_fixed(Entry(document, (), values), settings)
    study = replace(study, maps=dict(maps), fixed=fixed)
    return study, expand(study).settings(0)


def _spec(cell: Any) -> dict[str, Any]:
    """Return the spec of a row without parameters, maps and the section `record`."""
    pairs = cell("streams").text().split()
    replicate = cell("replicate").whole(0, MOST_TRIALS - 1)
    spec = {
        "study": "stored",
        "model": cell("model").text(),
        "preset": cell("preset").text(),
        "seed": cell("seed").whole(0),
    }
    if cell("seed_listed").truth():
        spec["seeds"] = (spec["seed"],)
    else:
        spec["replicates"] = replicate + 1
    streams = dict(word.partition("=")[::2] for word in pairs)
    return written(spec, *spec_parts()) | {"streams": streams}
