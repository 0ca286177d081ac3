"""The job of a stored trial, from its row."""

from collections.abc import Mapping
from typing import Any

from kernels.catalogue import Catalogue
from sweep.design.jobs import Job, directed, point_id
from sweep.design.trial_ids import TRIAL_ID
from sweep.errors import StoreError
from sweep.spec.continuing import DIRECTION, DOWN, PARENT, UP
from sweep.spec.maps import OwnMap
from sweep.spec.study import Study
from sweep.tables.stored_spec import accepted
from sweep.tables.stored_trials import StoredTrial


def stored_job(
    study: str, known: Catalogue, maps: Mapping[str, OwnMap], stored: StoredTrial
) -> Job:
    """The job that runs a stored trial of `study` again; `maps` are those that its plan
    brings, and `known` has what other names stand for.

    Its point is that of the settings in the row. Raises as `stored_point`.
    """
    return stored_point(study, known, maps, stored, stored.record)[1]


def stored_point(
    study: str,
    known: Catalogue,
    maps: Mapping[str, OwnMap],
    stored: StoredTrial,
    record: Mapping[str, Any],
) -> tuple[Study, Job]:
    """The study of one point that launches a stored trial again, where it records what
    `record` says as a spec does; and its job, which has the id of the stored one.

    Raises StoreError where the row is none that a launch can have written, see
    `accepted`, and where the spec as last launched has another map of that name.
    """
    row, name = stored.row, str(stored.row.get("map"))
    is_known = row.get("model") in known.models
    if is_known and name not in known.maps and name not in maps:
        raise _without_map(study, name)
    once, settings = accepted(study, known, stored, maps, record)
    direction, parent = _linked(study, row)
    point = point_id(once.model, once.preset, settings, once.preset_settings, maps)
    point = directed(point, direction)
    if name in maps and row["point"] != point:
        raise _without_map(study, name)
    job = Job(
        trial_id=row["trial_id"],
        point=point,
        replicate=row["replicate"],
        seed=once.seed,
        literal=once.seeds is not None,
        model=once.model,
        preset=once.preset,
        settings=settings,
        record=once.record,
        streams=once.streams,
        time_limit=None,
        obstacles=maps[name].obstacles if name in maps else None,
        known=known,
        direction=direction,
        parent=parent,
    )
    return once, job


def _linked(study: str, row: Mapping[str, Any]) -> tuple[str, str]:
    """The direction of a link, and the trial where it begins; "" where there is none.
    Raises StoreError for what no launch writes.
    """
    direction, parent = row.get(DIRECTION) or "", row.get(PARENT) or ""
    if direction not in ("", UP, DOWN) or not (
        parent == "" or TRIAL_ID.fullmatch(parent)
    ):
        words = f"is a link in the direction {direction!r}, from trial {parent!r}"
        raise StoreError(
            f"trial {row['trial_id']} {words}: no launch writes that", study
        )
    return direction, parent


def _without_map(study: str, name: object) -> StoreError:
    return StoreError(
        f"the spec as last launched does not have the map {name} of this trial", study
    )
