"""The job of a stored trial, from its row."""

from collections.abc import Mapping
from typing import Any

from kernels.catalogue import Catalogue
from sweep.design import TRIAL_ID, Job, directed, of_all_events, point_id
from sweep.errors import StoreError
from sweep.spec import DIRECTION, DOWN, PARENT, UP, OwnMap, Study
from sweep.tables.stored_spec import accepted
from sweep.tables.trial_rows import StoredTrial


def stored_job(
    study: str, catalogue: Catalogue, maps: Mapping[str, OwnMap], stored: StoredTrial
) -> Job:
    """Return the job that runs a stored trial again.

    The point of the job has the parameters in the row.

    Parameters
    ----------
    study : str
        The study, for errors.
    catalogue : Catalogue
        The models, metrics, maps and more by name.
    maps : mapping
        The maps in the plan of the study, by name.
    stored : StoredTrial

    Raises
    ------
    StoreError
        If `stored_point` raises this error.
    """
    return stored_point(study, catalogue, maps, stored, record=stored.record)[1]


def stored_point(
    study: str,
    catalogue: Catalogue,
    maps: Mapping[str, OwnMap],
    stored: StoredTrial,
    record: Mapping[str, Any],
) -> tuple[Study, Job]:
    """Return a study that launches a stored trial again, and its job.

    The study has one point. The job has the id of the stored trial.

    Parameters
    ----------
    study : str
        The study of the trial, for errors.
    catalogue : Catalogue
        The models, metrics, maps and more by name.
    maps : mapping
        The maps in the plan of the study, by name.
    stored : StoredTrial
    record : mapping
        The section `record` of the spec.

    Returns
    -------
    tuple of Study and Job

    Raises
    ------
    StoreError
        If no launch can have written the row, see `accepted`, and if the last launched
        spec lacks the map, or has a different map of that name.
    """
    row = stored.row
    name = str(row.get("map"))
    is_known = row.get("model") in catalogue.models
    if is_known and name not in catalogue.maps and name not in maps:
        raise _without_map(study, name)
    once, settings = accepted(study, catalogue, stored, maps, record=record)
    direction, parent = _linked(study, row)
    usual = once.preset_settings
    common = of_all_events(catalogue.models[once.model], settings, usual)
    point = point_id(once.model, once.preset, common, usual, maps=maps)
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
        catalogue=catalogue,
        direction=direction,
        parent=parent,
    )
    return once, job


def _linked(study: str, row: Mapping[str, Any]) -> tuple[str, str]:
    """Return the direction of a link, and the trial at whose end the link begins.

    For a trial that is no link, the direction and the trial are "". Raises StoreError
    for values that no launch writes.
    """
    direction = row.get(DIRECTION) or ""
    parent = row.get(PARENT) or ""
    if direction not in ("", UP, DOWN) or not (
        parent == "" or TRIAL_ID.fullmatch(parent)
    ):
        phrase = f"is a link in the direction {direction!r}, from trial {parent!r}"
        raise StoreError(
            f"trial {row['trial_id']} {phrase}: no launch writes such a row", study
        )
    return direction, parent


def _without_map(study: str, name: object) -> StoreError:
    return StoreError(
        f"the last launched spec does not have the map {name} of this trial", study
    )
