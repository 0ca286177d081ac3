"""One stored trial, run again from its row."""

import math
from typing import Any

from kernels.metrics import METRICS
from kernels.worlds import MAPS
from sweep.fields import fields
from sweep.jobs import Job, point_id
from sweep.maps import Obstacles, from_json
from sweep.names import unknown
from sweep.parquet import StoreError
from sweep.rows import trial_metrics
from sweep.spec import Record, Streams
from sweep.study import StoredStudy, StoredWorld
from sweep.trial import obstacles, simulate


def stored_job(study: StoredStudy, trial: str) -> tuple[Job, dict[str, Any]]:
    """The job of a stored trial, and its row.

    Raises StoreError where there is no such trial, and where the spec as last launched has another map of that name.
    """
    import pyarrow as pa

    table = study.store.read("trials", trial_ids=pa.array([trial]))
    if table.num_rows == 0:
        known = study.plan["trial_id"].to_pylist()
        raise StoreError(f"study {study.name}: {unknown('trial', trial, known)}")
    row: dict[str, Any] = table.to_pylist()[0]
    settings = {name: row[name] for name in fields(row["model"])}
    streams = dict(item.split("=") for item in row["streams"].split())
    job = Job(
        trial_id=trial,
        point=row["point"],
        replicate=row["replicate"],
        seed=row["seed"],
        literal=row["seed_listed"],
        model=row["model"],
        preset=row["preset"],
        settings=settings,
        record=_record(row),
        streams=Streams(**streams),
        time_limit=None,
        obstacles=_obstacles(study, row, settings),
    )
    return job, row


def _obstacles(study: StoredStudy, row: dict[str, Any], settings: dict[str, Any]) -> Obstacles | None:
    """Those of a map of the spec's own, None for a built-in one."""
    name = row["map"]
    if name in MAPS:
        return None
    maps = {own: from_json(stored) for own, stored in study.provenance["maps"].items()}
    if row["point"] != point_id(row["model"], row["preset"], settings, maps):
        raise StoreError(f"study {study.name}: the spec as last launched does not have the map {name} of this trial")
    return maps[name].obstacles


def _record(row: dict[str, Any]) -> Record:
    metrics = tuple(name for name in METRICS if name in row and f"{name}_mean" in row)
    return Record(metrics=metrics, every=row["every"])


def stored_world(study: StoredStudy, trial: str) -> StoredWorld:
    """The world of a stored trial, drawn again. Raises StoreError as `stored_job` does."""
    job, _ = stored_job(study, trial)
    return StoredWorld(float(job.settings["width"]), float(job.settings["height"]), obstacles(job))


def replay(study: StoredStudy, trial: str) -> tuple[str, bool]:
    """A report on the trial run again, and whether every stored metric has come out to the same bits.

    An exception of the trial is raised as it is.
    """
    job, row = stored_job(study, trial)
    result = simulate(job)
    found = {"status": result.status, "last_step": result.step} | trial_metrics(result)
    differing = [name for name, value in found.items() if not _equal(value, row[name])]
    lines = [f"trial {trial}"]
    for name, value in found.items():
        lines.append(f"{name:34} {value}" + (f", but stored is {row[name]}" if name in differing else ""))
    lines.append("differs from what is stored" if differing else "equal to what is stored, to the last bit")
    return "\n".join(lines), not differing


def _equal(value: Any, stored: Any) -> bool:
    both_nan = isinstance(value, float) and isinstance(stored, float) and math.isnan(value) and math.isnan(stored)
    return both_nan or bool(value == stored)
