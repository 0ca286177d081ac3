"""One stored trial, run again from its row."""

from typing import Any

from kernels.worlds import MAPS
from sweep.fields import fields
from sweep.jobs import Job, point_id
from sweep.keeping.comparison import differences
from sweep.keeping.stored import StoredTrial, stored_trials
from sweep.maps import Obstacles, OwnMap, from_json
from sweep.names import unknown
from sweep.spec import Streams
from sweep.storing.parquet import StoreError
from sweep.storing.rows import trial_metrics
from sweep.study import StoredStudy, StoredWorld
from sweep.trial import obstacles, simulate


def stored_trial(study: StoredStudy, trial: str) -> StoredTrial:
    """A stored trial by its id. Raises StoreError where there is no such trial."""
    found = stored_trials(study.store, [trial])
    if not found:
        raise StoreError(f"study {study.name}: {unknown('trial', trial, study.plan['trial_id'].to_pylist())}")
    return found[0]


def stored_job(study: StoredStudy, stored: StoredTrial) -> Job:
    """The job that runs a stored trial again; its point is that of the settings in the row.

    Raises StoreError where the spec as last launched has another map of that name.
    """
    row = stored.row
    settings = {name: row[name] for name in fields(row["model"])}
    maps = {own: from_json(about) for own, about in study.provenance.get("maps", {}).items()}
    streams = dict(item.split("=") for item in row["streams"].split())
    return Job(
        trial_id=row["trial_id"],
        point=point_id(row["model"], row["preset"], settings, maps),
        replicate=row["replicate"],
        seed=row["seed"],
        literal=row["seed_listed"],
        model=row["model"],
        preset=row["preset"],
        settings=settings,
        record=stored.record,
        streams=Streams(**streams),
        time_limit=None,
        obstacles=_obstacles(study, row, maps),
    )


def _obstacles(study: StoredStudy, row: dict[str, Any], maps: dict[str, OwnMap]) -> Obstacles | None:
    """Those of a map of the spec's own, None for a built-in one."""
    name = row["map"]
    if name in MAPS:
        return None
    settings = {name: row[name] for name in fields(row["model"])}
    if row["point"] != point_id(row["model"], row["preset"], settings, maps):
        raise StoreError(f"study {study.name}: the spec as last launched does not have the map {name} of this trial")
    return maps[name].obstacles


def stored_world(study: StoredStudy, trial: str) -> StoredWorld:
    """The world of a stored trial, drawn again. Raises StoreError as `stored_trial` and `stored_job` do."""
    job = stored_job(study, stored_trial(study, trial))
    return world_of(job)


def world_of(job: Job) -> StoredWorld:
    """The world of a trial, drawn from its job."""
    return StoredWorld(float(job.settings["width"]), float(job.settings["height"]), obstacles(job))


def replay(study: StoredStudy, trial: str) -> tuple[str, bool]:
    """A report on the trial run again, and whether all that is stored of it has come out to the same bits.

    An exception of the trial is raised as it is.
    """
    stored = stored_trial(study, trial)
    result = simulate(stored_job(study, stored))
    differing = differences(study.name, stored, result)
    lines = [f"trial {trial}"]
    for name, value in ({"status": result.status, "last_step": result.step} | trial_metrics(result)).items():
        lines.append(f"{name:34} {value}")
    lines += [str(difference) for difference in differing]
    tables = ", ".join(["trials", *stored.tables])
    lines.append("differs from what is stored" if differing else f"equal to what is stored, to the last bit: {tables}")
    return "\n".join(lines), not differing
