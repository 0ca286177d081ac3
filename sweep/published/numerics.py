"""Numerics: variants that should change no result but for chance and numerical error.

They have half the time step, another order of updates, or another seed. What the seed
turns is turned by chance: it says how much the others mean.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from sweep.methods.robustness.variants import in_parts
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
from sweep.spec.study import Study

UPDATE = "update"
PARTS = 2
"""The shorter steps that one step is cut into."""


def numerics(publication: Publication) -> Makers:
    """The numerics of a publication: `dt-half`, `update-synchronous` or another order,
    and `seed-other`.
    """
    studies = needed_studies(publication)
    seeds = {
        spec: SpecChange(keys=_other_seeds(study)) for spec, study in studies.items()
    }
    about = "all seeds plus 1"
    return {
        "dt-half": partial(_half_step, publication, studies),
        **_other_updates(publication, studies),
        "seed-other": partial(
            altered, publication, "numerics", "seed-other", about, seeds
        ),
    }


def _half_step(publication: Publication, studies: Mapping[str, Study]) -> Variant:
    """Half the time step, as `validate` cuts it: with twice the steps, frames at the
    same times, and settings that act once in each step changed by their rules.

    Its studies are told in the steps of the original, so that each claim finds the
    frames, durations and settings that it names. Claims on what is measured over one
    step are not judged: see sweep.published.clocks.
    """
    changes, refused = {}, {}
    for spec, study in studies.items():
        try:
            keys = in_parts(study, PARTS)
        except ValueError as error:
            refused[spec] = f"{spec}.yaml cannot have half a step: {error}"
        else:
            changes[spec] = SpecChange(keys.pop(FIXED, {}), keys)
    return altered(
        publication,
        "numerics",
        "dt-half",
        "half the time step, twice the steps",
        changes,
        refused=refused,
        clock=PARTS,
    )


def _other_updates(publication: Publication, studies: Mapping[str, Study]) -> Makers:
    """Each order of updates, in the specs that have another one."""
    free = {spec: one for spec, one in studies.items() if is_free(one, UPDATE)}
    orders = [order for one in free.values() for order in one.settings[UPDATE].choices]
    fixed = {
        spec: f"{spec}.yaml has no single order of updates"
        for spec in studies
        if spec not in free
    }
    found: dict[str, Callable[[], Variant]] = {}
    for order in dict.fromkeys(orders):
        changes = {
            spec: SpecChange({UPDATE: order})
            for spec, study in free.items()
            if value_of(study, UPDATE) != order
        }
        if changes:
            name = f"{UPDATE}-{order}"
            found[name] = partial(
                altered,
                publication,
                "numerics",
                name,
                f"updates are {order}",
                changes,
                refused=fixed,
            )
    return found


def _other_seeds(study: Study) -> dict[str, Any]:
    """The seed, and the literal seeds where a spec has some, plus 1."""
    other: dict[str, Any] = {"seed": study.seed + 1}
    if study.seeds is not None:
        other["seeds"] = [seed + 1 for seed in study.seeds]
    return other
