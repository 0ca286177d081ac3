"""Numerics: variants that should change no result but for chance and numerical error.

They have half the time step, another order of updates, or another seed. What the seed
turns is turned by chance: it says how much the others mean.
"""

import copy
from collections.abc import Iterator, Mapping
from typing import Any, cast

from sweep.published.clocks import STEPS, TIME_STEP, counted_in_steps
from sweep.published.publications import Publication
from sweep.published.variants import (
    SpecChange,
    Variant,
    altered,
    is_free,
    needed_studies,
    value_of,
)
from sweep.spec.settings import Value
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import Study

UPDATE = "update"
PARTS = 2
"""The shorter steps that one step is cut into."""


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

    Its studies are told in the steps of the original, so that each claim finds the
    frames, and durations, that it names. Claims on what is measured over one step are
    not judged: see sweep.published.clocks.
    """
    changes, refused = {}, {}
    for spec, study in studies.items():
        if not is_free(study, TIME_STEP):
            refused[spec] = f"{spec}.yaml has no single {TIME_STEP}"
        elif unlisted := _unlisted(study):
            refused[spec] = f"{spec}.yaml has no list of {' and '.join(unlisted)}"
        else:
            changes[spec] = _halved(study)
    return altered(
        publication,
        "numerics",
        f"{TIME_STEP}-half",
        f"half the {TIME_STEP}, twice the {STEPS}",
        changes,
        refused=refused,
        clock=PARTS,
    )


def _unlisted(study: Study) -> list[str]:
    """What is counted in steps and has neither a single value nor a list of them."""
    return [
        name
        for name in counted_in_steps(study)
        if not is_free(study, name) and _axis_with(study, name) is None
    ]


def _halved(study: Study) -> SpecChange:
    """Half the time step, and all that is counted in steps doubled."""
    step = cast(float, value_of(study, TIME_STEP))
    fixed: dict[str, Value] = {TIME_STEP: step / PARTS}
    spec = copy.deepcopy(_spec(study))
    keys: dict[str, Any] = {
        "record": spec.get("record", {}) | {"every": PARTS * study.record.every}
    }
    for name in counted_in_steps(study):
        if is_free(study, name):
            fixed[name] = PARTS * cast(int, value_of(study, name))
            continue
        axis = cast(dict[str, Any], _axis_with(study, name, spec))
        axis[name] = [PARTS * value for value in axis[name]]
        keys["sweep"] = spec["sweep"]
    return SpecChange(fixed, keys)


def _spec(study: Study) -> dict[str, Any]:
    found: dict[str, Any] = parse_document(study.text, study.path).value
    return found


def _axis_with(
    study: Study, setting: str, spec: dict[str, Any] | None = None
) -> dict[str, Any] | None:
    """The mapping of a spec in which the values of a setting on an axis are a list."""
    place = study.place_of(setting)
    if place is None or place[0] != "sweep":
        return None
    sweep = (spec or _spec(study))["sweep"]
    axis = sweep[place[1]]
    zipped = axis.get("zip") if isinstance(axis, dict) else None
    for found in (sweep, zipped):
        if isinstance(found, dict) and isinstance(found.get(setting), list):
            return found
    return None


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
