"""Numerics: variants that differ only in numerical error and chance.

A variant has half the time step, another order of updates, or another seed. A verdict
that depends on the seed is due to chance. The number of such verdicts is the baseline
for the other variants.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from sweep.methods.robustness import in_parts
from sweep.published.publications import FIXED, Publication
from sweep.published.variants import (
    Makers,
    SpecChange,
    Variant,
    altered,
    is_free,
    needed_studies,
    value_of,
)
from sweep.spec import Study

UPDATE = "update"
PARTS = 2
"""Number of shorter steps per step."""


def numerics(publication: Publication) -> Makers:
    """Return the numerics of a publication.

    The variants are `dt-half`, `update-synchronous` or another order, and `seed-other`.
    """
    studies = needed_studies(publication)
    seeds = {
        spec: SpecChange(keys=_other_seeds(study)) for spec, study in studies.items()
    }
    return {
        "dt-half": partial(_half_step, publication, studies),
        **_other_updates(publication, studies),
        "seed-other": partial(
            altered,
            publication,
            kind="numerics",
            name="seed-other",
            description="all seeds plus 1",
            changes=seeds,
        ),
    }


def _half_step(publication: Publication, studies: Mapping[str, Study]) -> Variant:
    """Return the variant with half the time step, by the rules of `validate`.

    The variant has twice the steps, and frames at unchanged times. Parameters that act
    once per step change accordingly. The studies are converted to the original steps,
    so that each claim finds frames, durations and parameters. Claims on metrics over
    one step are not judged: see sweep.published.clocks.
    """
    changes = {}
    refused = {}
    for spec, study in studies.items():
        try:
            keys = in_parts(study, PARTS)
        except ValueError as error:
            refused[spec] = f"{spec}.yaml cannot have half a time step: {error}"
        else:
            changes[spec] = SpecChange(keys.pop(FIXED, {}), keys)
    return altered(
        publication,
        kind="numerics",
        name="dt-half",
        description="half the time step, twice the steps",
        changes=changes,
        refused=refused,
        clock=PARTS,
    )


def _other_updates(publication: Publication, studies: Mapping[str, Study]) -> Makers:
    """Return the variants with other orders of updates."""
    free = {spec: study for spec, study in studies.items() if is_free(study, UPDATE)}
    orders = [
        order for study in free.values() for order in study.settings[UPDATE].choices
    ]
    fixed = {
        spec: f"{spec}.yaml has no single order of updates"
        for spec in studies
        if spec not in free
    }
    makers: dict[str, Callable[[], Variant]] = {}
    for order in dict.fromkeys(orders):
        changes = {
            spec: SpecChange({UPDATE: order})
            for spec, study in free.items()
            if value_of(study, UPDATE) != order
        }
        if changes:
            name = f"{UPDATE}-{order}"
            makers[name] = partial(
                altered,
                publication,
                kind="numerics",
                name=name,
                description=f"updates are {order}",
                changes=changes,
                refused=fixed,
            )
    return makers


def _other_seeds(study: Study) -> dict[str, Any]:
    """Return the seed plus 1, and literal seeds of a spec plus 1."""
    other: dict[str, Any] = {"seed": study.seed + 1}
    if study.seeds is not None:
        other["seeds"] = [seed + 1 for seed in study.seeds]
    return other
