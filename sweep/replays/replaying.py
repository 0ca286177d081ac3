"""The repetition of a stored trial from its row in the store."""

from sweep.replays.bits import differences
from sweep.store import trial_metrics
from sweep.tables import StoredStudy
from sweep.trial import ended_by_ctrl_c, simulate


def replay(study: StoredStudy, trial: str) -> tuple[str, bool]:
    """Run a stored trial again and compare it with its stored values.

    `trial` is the id of a trial or the beginning of an id, in the form of
    `study.trial`. An exception of the trial is raised unchanged.

    Returns
    -------
    report : str
        The status, last step and metrics, and each difference.
    same : bool
        True if all stored values are bitwise identical.
    """
    stored = study.trial(trial)
    job = study.job(stored)
    with ended_by_ctrl_c():
        result = simulate(job)
    differing = differences(study.name, stored, result)
    lines = [f"trial {job.trial_id}"]
    if job.catalogue.runs:
        lines.append(f"{'code':34} {', '.join(job.catalogue.runs)}, as stored")
    lines += [f"{path}: another file now" for path in study.other_now(stored)]
    for name, value in (
        {"status": result.status, "last_step": result.step} | trial_metrics(result)
    ).items():
        lines.append(f"{name:34} {value}")
    lines += [str(difference) for difference in differing]
    tables = ", ".join(["trials", *stored.tables])
    lines.append(
        "differs from the stored values"
        if differing
        else f"bitwise identical to the stored values: {tables}"
    )
    return "\n".join(lines), not differing
