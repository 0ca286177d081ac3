"""Variants: a publication with some of its studies changed.

Each variant runs and is judged as the publication at the quick scale is, with the same
random numbers. What its claims say with it is compared with what they say without it.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal, get_args

from sweep.design.design import Design, expand
from sweep.errors import SpecError
from sweep.own_code.reading import study_of
from sweep.published.claims import Claim
from sweep.published.measures import misfit, specs_of
from sweep.published.program_mutants import PROGRAM_MUTANTS, ProgramMutant
from sweep.published.publications import (
    FIXED,
    QUICK,
    Mutant,
    Publication,
    read_mutant,
)
from sweep.spec.settings import Value
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import Study

Kind = Literal["mutants", "details", "numerics"]
"""mutants: wrong versions of the studies, which published.yaml names, and of the
program; details: other values of settings; numerics: another time step, order of
updates or seed.
"""
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Variant:
    """A publication with changed studies.

    kind         what is changed
    name         its name, once in a kind
    description  what is changed, in words
    publication  the publication with the changed studies
    share        by which share of its value one setting is changed; None for what is no
                 such change
    program      the mistake of the program that runs and judges it; None for our own
    """

    kind: Kind
    name: str
    description: str
    publication: Publication
    share: float | None = None
    program: ProgramMutant | None = None


@dataclass(frozen=True)
class SpecChange:
    """What a variant changes in a spec: values under `fixed`, and whole keys."""

    fixed: Mapping[str, Value] = field(default_factory=dict)
    keys: Mapping[str, Any] = field(default_factory=dict)


Makers = Mapping[str, Callable[[], Variant]]
"""What makes each variant of a kind, by its name: to make all takes seconds."""


def mutants(publication: Publication) -> Makers:
    """The mutants of a publication, and those of the program. To make one with which a
    measure finds no trials raises SpecError.
    """
    needed = needed_studies(publication)
    own = {one.name: partial(_mutant, publication, one) for one in publication.mutants}
    return own | {
        name: partial(of_program, publication, name, mistake.changed(needed, ()))
        for name, mistake in PROGRAM_MUTANTS.items()
    }


def _mutant(publication: Publication, one: Mutant) -> Variant:
    changed = read_mutant(publication, one.name)
    return Variant("mutants", one.name, one.description, changed)


def of_program(publication: Publication, name: str, specs: Collection[str]) -> Variant:
    """The publication as a mutant of the program of this name. The trials of these
    specs are its own; they have the settings of ours.
    """
    mistake = PROGRAM_MUTANTS[name]
    changes = {spec: SpecChange() for spec in specs}
    variant = altered(publication, "mutants", name, mistake.description, changes)
    return replace(variant, program=mistake)


def counted(publication: Publication) -> list[Claim]:
    """The claims whose verdicts are compared."""
    return [claim for claim in publication.claims if claim.counted]


def needed_studies(publication: Publication) -> dict[str, Study]:
    """The studies of the claims whose verdicts are compared, by their specs."""
    return {
        spec: publication.studies[spec]
        for claim in counted(publication)
        if claim.measure
        for spec in specs_of(claim.measure, publication.studies)
    }


def is_free(study: Study, setting: str) -> bool:
    """Whether a study has this setting, and one value of it for all its points."""
    place = study.place_of(setting)
    return setting in study.settings and place in (None, (FIXED, setting))


def value_of(study: Study, setting: str) -> Value:
    """The one value of a setting that is free."""
    return (study.preset_settings | study.fixed)[setting]


def altered(
    publication: Publication,
    kind: Kind,
    name: str,
    about: str,
    changes: Mapping[str, SpecChange],
    *,
    share: float | None = None,
    refused: Mapping[str, str] | None = None,
    clock: int = 1,
) -> Variant:
    """The publication with the changes, by spec, and with its counted claims alone.

    A spec that they make wrong stays as it is. The claims that it tests cannot be
    tested then, and neither can those on specs that are `refused`, by spec with the
    reason, or on points and frames that are no longer there.

    `clock` of the new steps are one of the old. The new studies are told in the old
    ones, and so have all their points and frames.
    """
    made, wrong = {}, dict(refused or {})
    for spec, change in changes.items():
        try:
            made[spec] = _changed(publication.studies[spec], change, f"{kind}/{name}")
        except SpecError as error:
            said = "; ".join(str(one).split(": ", 1)[-1] for one in error.mistakes)
            wrong[spec] = f"{spec}.yaml cannot be changed so: {said}"
    told = clock > 1
    changed = replace(
        publication,
        studies={**publication.studies, **{spec: made[spec][0] for spec in made}},
        claims=[
            _fitted(claim, {} if told else made, wrong)
            for claim in counted(publication)
        ],
        clocks=dict.fromkeys(made, clock) if told else {},
    )
    return Variant(kind, name, about, changed, share)


def _fitted(
    claim: Claim,
    made: Mapping[str, tuple[Study, Design]],
    refused: Mapping[str, str],
) -> Claim:
    """The claim, or why it cannot be tested. A function of figures.py is tested by the
    spec of its claim.
    """
    if claim.measure is None or claim.spec is None:
        return claim
    specs = specs_of(claim.measure, [claim.spec])
    reasons = [refused[spec] for spec in specs if spec in refused]
    reason = "; ".join(reasons) or misfit(claim.measure, claim.spec, made)
    return replace(claim, untestable=claim.untestable or reason)


def _changed(study: Study, change: SpecChange, prefix: str) -> tuple[Study, Design]:
    """The study with a change, under another name, and its design. Raises SpecError."""
    spec = parse_document(study.text, study.path).value
    fixed = spec.get(FIXED, {}) | dict(change.fixed)
    name = f"{prefix}/{study.name.removeprefix(f'{QUICK}/')}"
    new = {**change.keys, "study": name} | ({FIXED: fixed} if fixed else {})
    made = study_of(spec | new, study.path)
    return made, expand(made)
