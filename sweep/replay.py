"""One stored trial, run again from its row."""

from kernels.worlds import MAPS
from sweep.jobs import Job, point_id
from sweep.keeping.comparison import differences
from sweep.keeping.stored import StoredTrial, stored_trials
from sweep.names import unknown
from sweep.running.interrupts import ended_by_ctrl_c
from sweep.stored_spec import accepted
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

    Raises StoreError where the row is none that a launch can have written, see `accepted`, and
    where the spec as last launched has another map of that name.
    """
    row, name, maps = stored.row, stored.row.get("map"), study.maps
    if name not in MAPS and name not in maps:
        raise _without_map(study, name)
    once, settings = accepted(study.name, stored, maps)
    point = point_id(once.model, once.preset, settings, maps)
    if name in maps and row["point"] != point:
        raise _without_map(study, name)
    return Job(
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
    )


def _without_map(study: StoredStudy, name: object) -> StoreError:
    return StoreError(f"study {study.name}: the spec as last launched does not have the map {name} of this trial")


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
    job = stored_job(study, stored)
    with ended_by_ctrl_c():
        result = simulate(job)
    differing = differences(study.name, stored, result)
    lines = [f"trial {trial}"]
    for name, value in ({"status": result.status, "last_step": result.step} | trial_metrics(result)).items():
        lines.append(f"{name:34} {value}")
    lines += [str(difference) for difference in differing]
    tables = ", ".join(["trials", *stored.tables])
    lines.append("differs from what is stored" if differing else f"equal to what is stored, to the last bit: {tables}")
    return "\n".join(lines), not differing
