"""The sides of a comparison as a command names them: `STUDY`, `STUDY:n=50,map=empty` or
`STUDY:as_written`.
"""

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from sweep.analysis import agrees
from sweep.errors import ChoiceError, StoreError
from sweep.spec.settings import NotAllowedError, Setting, Value, settings_of_study
from sweep.store.locations import Location
from sweep.tables.stored_study import StoredStudy, details
from sweep.text import SHORT_LIST, unknown

INSIDE = {"parts", "writing", "figures"}
PLAN = "/plan.parquet"
CLOSEST = 3
DETAIL = "detail"
BOOLEANS = {"true": True, "yes": True, "false": False, "no": False}


@dataclass(frozen=True, eq=False)
class Side:
    """The trials of a study that `text` names, and the settings to which it gives a
    value, in `named`.
    """

    text: str
    study: StoredStudy
    trials: pd.DataFrame
    named: frozenset[str]

    @property
    def model(self) -> str:
        """The model of the study."""
        return str(self.trials["model"].iloc[0])

    @property
    def kernels(self) -> str:
        """The hash of the kernels that computed them."""
        return str(self.study.provenance["kernels_sha"])

    @property
    def missing(self) -> int:
        """How many trials of the study's spec are not stored."""
        return int(self.study.plan.num_rows) - len(self.study.trials)


def read_side(text: str, results: Location) -> Side:
    """The trials that `text` names, in the order of their study.

    After the study's name and a colon come settings, or presets where the study ablates
    one: with the study's own nothing is changed, with the other all is. Raises
    ChoiceError for a study, setting, value or preset that is not there, and where no
    trial is left.
    """
    name, colon, rest = text.partition(":")
    study = _stored(name, results)
    trials, named = study.trials, set[str]()
    if trials.empty:
        raise StoreError(f"study {name} has no stored trial")
    for item in rest.split(",") if colon else ():
        what, equals, value = (part.strip() for part in item.partition("="))
        if not what or (equals and not value):
            raise ChoiceError(
                f"{text}: what follows the colon is setting=value[,setting=value] or a"
                " preset"
            )
        if what in named:
            raise ChoiceError(f"{text}: {what} has a value already")
        chosen, names = (
            _with_setting(study, what, value) if equals else _with_preset(study, what)
        )
        trials, named = trials[chosen[trials.index]], named | names
    if trials.empty:
        raise ChoiceError(f"study {name}: no point has all of {rest}")
    return Side(text, study, trials.reset_index(drop=True), frozenset(named))


def listed(name: str, column: "pd.Series[Any]", near: Value | None = None) -> str:
    """The values of a setting in words: all where they are few, else some, of numbers
    those closest to `near`.
    """
    values = list(dict.fromkeys(column.tolist()))
    if len(values) <= SHORT_LIST:
        return f"values of {name}: {', '.join(map(str, values))}"
    if isinstance(near, int | float):
        closest = sorted(values, key=lambda value: abs(value - near))
        return (
            f"the closest of {len(values):,} values:"
            f" {', '.join(map(str, closest[:CLOSEST]))}"
        )
    return f"values of {name}: {', '.join(map(str, values[:SHORT_LIST]))}, ..."


def _stored(name: str, results: Location) -> StoredStudy:
    studies = _studies(results)
    if name not in studies:
        raise ChoiceError(f"{results}: {unknown('study', name, studies)}")
    return StoredStudy(name, results)


def _studies(results: Location) -> list[str]:
    """The names of the studies below a folder, or a prefix."""
    if not isinstance(results, Path):
        return sorted(
            key.removesuffix(PLAN)
            for key in results.listed().found or ()
            if key.endswith(PLAN)
        )
    found = []
    for folder, inside, files in os.walk(results):
        inside[:] = sorted(set(inside) - INSIDE)
        found += (
            [Path(folder).relative_to(results).as_posix()]
            if "plan.parquet" in files
            else []
        )
    return sorted(found)


def _with_setting(
    study: StoredStudy, name: str, text: str
) -> tuple["pd.Series[bool]", set[str]]:
    """Which trials have the value that `text` writes, and the name of the setting."""
    trials = study.trials
    if name == DETAIL and study.about.ablated:
        return _with_detail(study, text)
    known = settings_of_study(str(trials["model"].iloc[0]), study.about.maps)
    if name not in known:
        raise ChoiceError(
            f"study {study.name}: {unknown('setting', name, known)}{_varied(study)}"
        )
    try:
        value = _parsed(text, known[name])
    except NotAllowedError as error:
        raise ChoiceError(f"study {study.name}: {error}") from None
    chosen = pd.Series(agrees(trials[name].to_numpy(), value), index=trials.index)
    if not chosen.any():
        raise ChoiceError(
            f"study {study.name}: no point has {name} = {text};"
            f" {listed(name, trials[name], value)}"
        )
    return chosen, {name}


def _parsed(text: str, setting: Setting) -> Value:
    """The value of a setting from its text. Raises NotAllowedError."""
    given: Any = text
    if setting.kind == "bool":
        given = BOOLEANS.get(text.lower(), text)
    elif setting.kind in ("float", "int"):
        with suppress(ValueError):
            given = float(text.replace(".inf", "inf"))
    return setting.coerce(given)


def _varied(study: StoredStudy) -> str:
    return (
        f" (the study varies {', '.join(study.varied)})"
        if study.varied
        else " (the study varies none)"
    )


def _with_preset(study: StoredStudy, preset: str) -> tuple["pd.Series[bool]", set[str]]:
    """Which trials have a preset's settings, and the names of all ablated ones."""
    own, ablated = (
        str(study.trials["preset"].iloc[0]),
        study.about.ablated,
    )
    if preset not in (own, *ablated):
        why = (
            ""
            if ablated
            else "; the study ablates no preset: name settings, as in n=50"
        )
        raise ChoiceError(
            f"study {study.name}: {unknown('preset', preset, [own, *ablated])}{why}"
        )
    if not ablated:
        return pd.Series(True, index=study.trials.index), set()
    groups = next(iter(ablated.values()))
    changed = "all" if len(groups) > 1 else groups[0][0]
    return _with_detail(study, "" if preset == own else changed)


def _with_detail(study: StoredStudy, detail: str) -> tuple["pd.Series[bool]", set[str]]:
    """Which trials have that detail changed, as `details` names it, and the names of
    all that the study ablates.
    """
    preset, groups = next(iter(study.about.ablated.items()))
    labels = details(study, preset).to_numpy()
    if detail not in labels:
        raise ChoiceError(
            f"study {study.name}:"
            f" {unknown(DETAIL, detail, dict.fromkeys(filter(None, labels)))}"
        )
    return pd.Series(labels == detail, index=study.trials.index), {
        name for group in groups for name in group
    }
