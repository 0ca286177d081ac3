"""The sides of a comparison, as a command names them.

A side is `STUDY`, `STUDY:n=50,map=empty` or `STUDY:as_written`, with a preset.
"""

from dataclasses import dataclass

import pandas as pd

from sweep.errors import ChoiceError, StoreError
from sweep.spec import label
from sweep.store import Location
from sweep.tables import Choice, StoredStudy, keep_apart
from sweep.text import unknown


@dataclass(frozen=True, eq=False)
class Side:
    """Trials of a study that a string names.

    Attributes
    ----------
    text : str
    study : StoredStudy
        The study of the trials.
    trials : DataFrame
        One row per trial, in the order of the study.
    named : frozenset of str
        Parameters to which the string gives a value.
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
        """The hash of the kernels that computed the trials."""
        return str(self.study.provenance["kernels_sha"])

    @property
    def missing(self) -> int:
        """The number of trials of the study's spec that are not stored."""
        return self.study.missing


def read_side(text: str, results: Location) -> Side:
    """Return the side that a string names, see `side_of`.

    StoreError if the folder `results` does not have the study.
    """
    return side_of(text, keep_apart(StoredStudy(study_named(text), results)))


def study_named(text: str) -> str:
    """Return the name of the study in the string of a side."""
    return text.partition(":")[0]


def side_of(text: str, study: StoredStudy) -> Side:
    """Return the side that a string names, of a loaded study.

    The name of the study and a colon come first, then values of parameters or presets.
    A preset needs a study that ablates a preset: the study's own preset means no
    change, the ablated preset all changes. The phases of a search are separate points
    in `study`, see `sweep.tables.kept_apart`.

    Raises
    ------
    ChoiceError
        The study does not have the parameter, value or preset.
    StoreError
        The trials are not stored.
    """
    name, colon, rest = text.partition(":")
    if study.trials.empty:
        raise StoreError("no trial of the study is stored", name)
    settings, named = _read(study, rest) if colon else ({}, frozenset[str]())
    trials = study.where(**settings).trials
    if trials.empty:
        raise StoreError(f"no trial with {rest} is stored", name)
    return Side(text, study, trials, named)


def _read(study: StoredStudy, text: str) -> tuple[dict[str, Choice], frozenset[str]]:
    """Return the choices of a string, and all parameters to which it gives a value."""
    settings: dict[str, Choice] = {}
    for name, value in study.chooser.split([text]).items():
        chosen = _of_preset(study, name) if value is None else {name: value}
        for setting, written in chosen.items():
            settings[setting] = study.chooser.value(setting, written)
    named = set(settings)
    for preset, groups in study.about.ablated.items():
        if study.detail(preset) in settings:
            named |= {name for group in groups for name in group}
    return settings, frozenset(named)


def _of_preset(study: StoredStudy, preset: str) -> dict[str, str]:
    """Return the values that select the trials of a preset.

    The result is empty for the preset of a study that ablates no preset.
    """
    own = str(study.trials["preset"].iloc[0])
    ablated = study.about.ablated
    if preset not in (own, *ablated):
        way = "or" if ablated else "the study ablates no preset:"
        raise ChoiceError(
            f"{unknown('preset', preset, [own, *ablated])};"
            f" {way} name parameters, for example {study.chooser.example}",
            study.name,
        )
    if preset == own:
        return {study.detail(other): "" for other in ablated}
    details = study.detail_names(preset)
    return {study.detail(preset): label([True] * len(details), details)}
