"""Variants: a publication with some changed studies.

Each variant runs and is judged like the publication at the quick scale, with equal
random numbers. Verdicts with and without the variant are compared.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal, get_args

from sweep.design import Design, expand
from sweep.errors import SpecError
from sweep.own_code import study_of
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
from sweep.spec import Study, Value, parse_document

Kind = Literal["mutants", "details", "numerics"]
"""Kind of a variant.

    mutants   wrong versions of the studies, from published.yaml, or of the program
    details   other values of parameters
    numerics  another time step, order of updates or seed
"""
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Variant:
    """A publication with changed studies.

    Attributes
    ----------
    kind : Kind
        Kind of the change.
    name : str
        Name, unique in a kind.
    description : str
        Change in words.
    publication : Publication
        The publication with the changed studies.
    share : float, optional
        Relative change of one parameter; None for other changes.
    program : ProgramMutant, optional
        Mistake of the program that runs and judges the variant; None for no mistake.
    """

    kind: Kind
    name: str
    description: str
    publication: Publication
    share: float | None = None
    program: ProgramMutant | None = None


@dataclass(frozen=True)
class SpecChange:
    """Changes of a variant to a spec: values under `fixed`, and complete keys."""

    fixed: Mapping[str, Value] = field(default_factory=dict)
    keys: Mapping[str, Any] = field(default_factory=dict)


Makers = Mapping[str, Callable[[], Variant]]
"""By name, the function that makes a variant. To make all variants takes seconds."""


def mutants(publication: Publication) -> Makers:
    """Return the mutants of a publication, and the mutants of the program.

    If a measure finds no trials in a mutant, the function of the mutant raises
    SpecError.
    """
    needed = needed_studies(publication)
    own = {
        mutant.name: partial(_mutant, publication, mutant)
        for mutant in publication.mutants
    }
    return own | {
        name: partial(of_program, publication, name, mistake.changed(needed, ()))
        for name, mistake in PROGRAM_MUTANTS.items()
    }


def _mutant(publication: Publication, mutant: Mutant) -> Variant:
    changed = read_mutant(publication, mutant.name)
    return Variant("mutants", mutant.name, mutant.description, changed)


def of_program(publication: Publication, name: str, specs: Collection[str]) -> Variant:
    """Return the publication as a mutant of the program.

    Parameters
    ----------
    publication : Publication
    name : str
        Name of the mutant.
    specs : collection of str
        Specs whose trials the mutant runs, with unchanged parameters.
    """
    mistake = PROGRAM_MUTANTS[name]
    changes = {spec: SpecChange() for spec in specs}
    variant = altered(
        publication, "mutants", name, mistake.description, changes=changes
    )
    return replace(variant, program=mistake)


def counted(publication: Publication) -> list[Claim]:
    """Return the claims with compared verdicts."""
    return [claim for claim in publication.claims if claim.counted]


def needed_studies(publication: Publication) -> dict[str, Study]:
    """Return the studies of the claims with compared verdicts, by spec."""
    return {
        spec: publication.studies[spec]
        for claim in counted(publication)
        if claim.measure
        for spec in specs_of(claim.measure, publication.studies)
    }


def is_free(study: Study, setting: str) -> bool:
    """Return True if a study has the parameter, with one value for all points."""
    place = study.place_of(setting)
    return setting in study.settings and place in (None, (FIXED, setting))


def value_of(study: Study, setting: str) -> Value:
    """Return the one value of a parameter that is free."""
    return (study.preset_settings | study.fixed)[setting]


def altered(
    publication: Publication,
    kind: Kind,
    name: str,
    description: str,
    changes: Mapping[str, SpecChange],
    *,
    share: float | None = None,
    refused: Mapping[str, str] | None = None,
    clock: int = 1,
) -> Variant:
    """Return the publication with changes by spec, and with counted claims only.

    A spec that becomes invalid by the change is unchanged, and the claims of the spec
    cannot be tested. Claims on specs in `refused`, or on points and frames that no
    longer exist, also cannot be tested.

    Parameters
    ----------
    publication : Publication
    kind : Kind
        Kind of the variant.
    name : str
        Name of the variant.
    description : str
        Change in words.
    changes : mapping of str to SpecChange
        Changes by spec.
    share : float, optional
        Relative change of one parameter.
    refused : mapping of str to str, optional
        Specs that cannot be changed, each with the reason.
    clock : int, default 1
        Number of new steps per old step. For a number above 1, studies are converted to
        the old steps, and so have all points and frames of the old studies.
    """
    designs = {}
    wrong = dict(refused or {})
    for spec, change in changes.items():
        try:
            designs[spec] = _changed(
                publication.studies[spec], change, f"{kind}/{name}"
            )
        except SpecError as error:
            text = "; ".join(
                str(mistake).split(": ", 1)[-1] for mistake in error.mistakes
            )
            wrong[spec] = f"{spec}.yaml cannot have this change: {text}"
    converted = clock > 1
    changed = replace(
        publication,
        studies={**publication.studies, **{spec: designs[spec][0] for spec in designs}},
        claims=[
            _fitted(claim, {} if converted else designs, wrong)
            for claim in counted(publication)
        ],
        clocks=dict.fromkeys(designs, clock) if converted else {},
    )
    return Variant(kind, name, description, changed, share=share)


def _fitted(
    claim: Claim,
    designs: Mapping[str, tuple[Study, Design]],
    refused: Mapping[str, str],
) -> Claim:
    """Return the claim, with the reason if it cannot be tested.

    A function of figures.py is tested by the spec of the claim.
    """
    if claim.measure is None or claim.spec is None:
        return claim
    specs = specs_of(claim.measure, [claim.spec])
    reasons = [refused[spec] for spec in specs if spec in refused]
    reason = "; ".join(reasons) or misfit(claim.measure, claim.spec, designs)
    return replace(claim, untestable=claim.untestable or reason)


def _changed(study: Study, change: SpecChange, prefix: str) -> tuple[Study, Design]:
    """Return the study with a change, under another name, and the design.

    Raises SpecError.
    """
    spec = parse_document(study.text, study.path).value
    fixed = spec.get(FIXED, {}) | dict(change.fixed)
    name = f"{prefix}/{study.name.removeprefix(f'{QUICK}/')}"
    new = {**change.keys, "study": name} | ({FIXED: fixed} if fixed else {})
    changed = study_of(spec | new, study.path)
    return changed, expand(changed)
