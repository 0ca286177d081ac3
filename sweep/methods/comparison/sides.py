"""The sides of a comparison as a command names them: `STUDY`, `STUDY:n=50,map=empty` or
`STUDY:as_written`.
"""

from dataclasses import dataclass

import pandas as pd

from sweep.errors import ChoiceError, StoreError
from sweep.spec.ablation import label
from sweep.store.locations import Location
from sweep.tables.choosing import Choice
from sweep.tables.search_phases import by_phase
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown


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
        return self.study.missing


def read_side(text: str, results: Location) -> Side:
    """The trials that `text` names, see `side_of`. Raises StoreError where there is no
    such study.
    """
    return side_of(text, by_phase(StoredStudy(study_named(text), results)))


def study_named(text: str) -> str:
    """The name of the study in the text of a side."""
    return text.partition(":")[0]


def side_of(text: str, study: StoredStudy) -> Side:
    """The trials that `text` names, in the order of their study, which is read already
    and has its phases apart.

    After the study's name and a colon come settings, or presets where the study ablates
    one: with the study's own nothing is changed, with the other all is. Raises
    ChoiceError for a setting, value or preset that is not there, and StoreError where
    no trial of it is.
    """
    name, colon, rest = text.partition(":")
    if study.trials.empty:
        raise StoreError("no trial of it is stored", name)
    settings, named = _read(study, rest) if colon else ({}, frozenset[str]())
    trials = study.where(**settings).trials
    if trials.empty:
        raise StoreError(f"no trial with {rest} is stored", name)
    return Side(text, study, trials, named)


def _read(study: StoredStudy, text: str) -> tuple[dict[str, Choice], frozenset[str]]:
    """What `text` chooses, and the names of all settings that it gives a value."""
    settings: dict[str, Choice] = {}
    for name, value in study.chooser.split([text]).items():
        chosen = _of_preset(study, name) if value is None else {name: value}
        for one, written in chosen.items():
            settings[one] = study.chooser.value(one, written)
    named = set(settings)
    for preset, groups in study.about.ablated.items():
        if study.detail(preset) in settings:
            named |= {name for group in groups for name in group}
    return settings, frozenset(named)


def _of_preset(study: StoredStudy, preset: str) -> dict[str, str]:
    """The setting that has a preset's trials: nothing for that of a study without
    another one.
    """
    own, ablated = str(study.trials["preset"].iloc[0]), study.about.ablated
    if preset not in (own, *ablated):
        way = "or" if ablated else "the study ablates no preset:"
        raise ChoiceError(
            f"{unknown('preset', preset, [own, *ablated])};"
            f" {way} name settings, as in {study.chooser.example}",
            study.name,
        )
    if preset == own:
        return {study.detail(other): "" for other in ablated}
    names = study.detail_names(preset)
    return {study.detail(preset): label([True] * len(names), names)}
