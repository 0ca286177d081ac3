"""Numerics: variants that should change no result but for chance and numerical error.

They have half the time step, another order of updates, or another seed. What the seed
turns is turned by chance: it says how much the others mean.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, cast

from sweep.published.claims import Claim
from sweep.published.measures import Call, Mean, MeanDifference
from sweep.published.publications import Publication
from sweep.published.variants import (
    SpecChange,
    Variant,
    altered,
    is_free,
    needed_studies,
    value_of,
)
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import Study

TIME_STEP, STEPS, UPDATE = "dt", "steps", "update"


def numerics(publication: Publication) -> Iterator[Variant]:
    """The numerics of a publication: `dt-half`, `update-synchronous` or another order,
    and `seed-other`.
    """
    studies = needed_studies(publication)
    yield _half_step(publication, studies)
    yield from _other_updates(publication, studies)
    seeds = {
        spec: SpecChange(keys=_other_seeds(study)) for spec, study in studies.items()
    }
    yield altered(publication, "numerics", "seed-other", "all seeds plus 1", seeds)


def _half_step(publication: Publication, studies: Mapping[str, Study]) -> Variant:
    """Half the time step and twice the steps, with a frame recorded at the same times.

    Claims on frames get the frames of the same times. A function of figures.py has its
    own numbers of frames, so it is not judged where the spec of its claim records any.
    """
    changes, refused = {}, {}
    for spec, study in studies.items():
        if is_free(study, TIME_STEP) and is_free(study, STEPS):
            changes[spec] = SpecChange(
                _halved(study), {"record": _half_as_often(study)}
            )
        else:
            refused[spec] = f"{spec}.yaml has no single {TIME_STEP} and {STEPS}"
    claims = [_at_same_times(claim, studies, changes) for claim in publication.claims]
    return altered(
        replace(publication, claims=claims),
        "numerics",
        f"{TIME_STEP}-half",
        f"half the {TIME_STEP}, twice the {STEPS}",
        changes,
        refused=refused,
    )


def _halved(study: Study) -> dict[str, float]:
    step, steps = (cast(float, value_of(study, name)) for name in (TIME_STEP, STEPS))
    return {TIME_STEP: step / 2, STEPS: 2 * steps}


def _half_as_often(study: Study) -> dict[str, Any]:
    """The section `record` of a spec, with twice as many steps between frames."""
    given: dict[str, Any] = parse_document(study.text, study.path).value.get(
        "record", {}
    )
    return given | {"every": 2 * study.record.every}


def _records_frames(study: Study) -> bool:
    return bool(study.record.series) or study.record.trajectories


def _at_same_times(
    claim: Claim, studies: Mapping[str, Study], changed: Mapping[str, SpecChange]
) -> Claim:
    """The claim with twice the numbers of its frames, in specs that are changed; or why
    it cannot be tested.
    """
    measure = claim.measure
    if isinstance(measure, Mean):
        return replace(claim, measure=_doubled(measure, changed))
    if isinstance(measure, MeanDifference):
        first, second = measure.first, measure.second
        sides = _doubled(first, changed), _doubled(second, changed)
        return replace(claim, measure=MeanDifference(*sides))
    if (
        isinstance(measure, Call)
        and claim.spec
        and claim.spec in changed
        and _records_frames(studies[claim.spec])
    ):
        said = f"{measure.function} may read frames, and their numbers change"
        return replace(claim, untestable=said)
    return claim


def _doubled(mean: Mean, changed: Mapping[str, SpecChange]) -> Mean:
    if mean.frames is None or mean.spec not in changed:
        return mean
    first, last = mean.frames
    return replace(mean, frames=(2 * first, 2 * last))


def _other_updates(
    publication: Publication, studies: Mapping[str, Study]
) -> Iterator[Variant]:
    """Each order of updates, in the specs that have another one."""
    free = {spec: one for spec, one in studies.items() if is_free(one, UPDATE)}
    orders = [order for one in free.values() for order in one.settings[UPDATE].choices]
    fixed = {
        spec: f"{spec}.yaml has no single order of updates"
        for spec in studies
        if spec not in free
    }
    for order in dict.fromkeys(orders):
        changes = {
            spec: SpecChange({UPDATE: order})
            for spec, study in free.items()
            if value_of(study, UPDATE) != order
        }
        if changes:
            yield altered(
                publication,
                "numerics",
                f"{UPDATE}-{order}",
                f"updates are {order}",
                changes,
                refused=fixed,
            )


def _other_seeds(study: Study) -> dict[str, Any]:
    """The seed, and the literal seeds where a spec has some, plus 1."""
    other: dict[str, Any] = {"seed": study.seed + 1}
    if study.seeds is not None:
        other["seeds"] = [seed + 1 for seed in study.seeds]
    return other
