"""The progress of studies, their launches, and the failures of trials."""

import shlex
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.explorer.asking import AskState, AskStudies
from sweep.explorer.scored import scales
from sweep.explorer.watching import Watched
from sweep.figures import MOST_MARKS
from sweep.store import Lock, device_said, local_folder
from sweep.tables import StoredStudy, causes_of, json_rows
from sweep.tables import studies as overview
from sweep.web import begin

DONE, NOT_DONE, MISSING = range(3)


def studies(watched: Watched, _question: AskStudies) -> dict[str, Any]:
    """Return the rows of `sweep list --json`, and the scales of the scorecards.

    `first` has the commands that launch a first study into the folder.
    """
    folder = local_folder(watched.results, "the list of studies needs")
    return {
        "studies": json_rows(overview(folder)),
        "scorecards": scales(watched),
        "first": [
            f"sweep init first.yaml --model {begin().model}",
            f"sweep launch first.yaml --results {shlex.quote(str(folder))}",
        ],
    }


def state(watched: Watched, question: AskState) -> dict[str, Any]:
    """Return the progress of a study.

    `revision` identifies the stored trials. If the page already has this revision, the
    answer has only this key and `running`, the owners of a launch. `counts` are trials
    by status. `rate` is in trials per second, and `left` in seconds. The two values are
    None if no launch runs, or if no trial was stored between questions of pages.
    `strip` has all trials in the order of the plan, see `_strip`. `causes` equal the
    causes of `sweep status --json`.
    """
    running = Lock(watched.place(question.study)).owners()
    revision = watched.revision(question.study)
    if question.known_revision == revision:
        return {"revision": revision, "running": running}
    revision, study = watched.counted(question.study)
    trials = study.trials
    counts = {str(name): int(n) for name, n in trials["status"].value_counts().items()}
    stored = len(trials)
    planned = int(study.plan.num_rows)
    rate = watched.rate(question.study, stored) if running else None
    return {
        "revision": revision,
        "running": running,
        "study": study.name,
        "about": _about(study),
        "points": len(study.points),
        "trials": planned,
        "counts": counts,
        "missing": planned - stored,
        "rate": rate,
        "left": (planned - stored) / rate if rate else None,
        "strip": _strip(study),
        "causes": [cause._asdict() for cause in causes_of(trials)],
        "metrics": study.metrics,
        "series": study.series_metrics,
        "settings": study.headings,
        "search": "; ".join(study.apart_notes),
    }


def _about(study: StoredStudy) -> dict[str, str]:
    """Return the origin of the results, in words."""
    origin = study.provenance
    commit = str(origin["git"].get("commit", "unknown"))
    modified = " (modified)" if origin["git"].get("diff") else ""
    return {
        "model": str(origin.get("model", "")),
        "preset": str(origin.get("preset", "")),
        "folder": str(study.store.folder),
        "kernels": str(origin["kernels_sha"])[:16],
        "commit": commit + modified,
        "processor": device_said(origin) or str(origin.get("cpu", "")),
        "spec": study.spec,
    }


def _strip(study: StoredStudy) -> dict[str, Any]:
    """Return all trials of the plan as at most MOST_MARKS marks.

    A mark represents `per` successive trials. A mark is a number from 0 to 2: done, not
    done (a trial failed, diverged or ran out of time) or missing. `row` is the number
    of marks per point, or 0 if a mark may represent several points.
    """
    ended = np.where(study.trials["status"] == "done", DONE, NOT_DONE)
    mark = np.full(study.plan.num_rows, MISSING)
    mark[_stored(study)] = ended
    per = -(-len(mark) // MOST_MARKS)
    blocks = [mark[start : start + per] for start in range(0, len(mark), per)]
    replicates = len(mark) / max(len(study.points), 1)
    return {
        "per": per,
        "row": int(replicates) if per == 1 and replicates.is_integer() else 0,
        "marks": [_together(block) for block in blocks],
    }


def _stored(study: StoredStudy) -> NDArray[np.bool_]:
    """Return which trials of the plan are stored, shape (T,).

    The rows of `trials` are in the order of the plan.
    """
    if not study.missing:
        return np.ones(study.plan.num_rows, np.bool_)
    stored = pa.array(study.trials["trial_id"], pa.string())
    is_stored: NDArray[np.bool_] = pc.is_in(study.plan["trial_id"], stored).to_numpy()
    return is_stored


def _together(block: NDArray[np.int64]) -> int:
    """Return the mark of successive trials; a trial that is not done has priority."""
    if (block == NOT_DONE).any():
        return NOT_DONE
    return MISSING if (block == MISSING).any() else DONE
