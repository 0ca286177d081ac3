"""How far studies are, what runs, and what went wrong."""

from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.explorer.asking import AskState, AskStudies
from sweep.explorer.scored import scales
from sweep.explorer.watching import Watched
from sweep.figures.marks import MOST_MARKS
from sweep.store.locations import local_folder
from sweep.store.lock import Lock
from sweep.store.origin import device_said
from sweep.tables.causes import causes_of
from sweep.tables.json_rows import json_rows
from sweep.tables.overview import studies as overview
from sweep.tables.search_phases import phases_said
from sweep.tables.stored_study import StoredStudy

DONE, NOT_DONE, MISSING = range(3)


def studies(watched: Watched, asked: AskStudies) -> dict[str, Any]:  # noqa: ARG001
    """The rows of `sweep list --json`, as `studies`, and the scales of the scorecards
    that there are.
    """
    found = overview(local_folder(watched.results, "the list of studies needs"))
    return {"studies": json_rows(found), "scorecards": scales(watched)}


def state(watched: Watched, asked: AskState) -> dict[str, Any]:
    """How far a study is.

    `revision` is a word for what is stored; where the page has seen it, only that and
    `running`, who launches it, are answered. `counts` are trials by status; `rate`, in
    trials a second, and `left`, in seconds, are null where nothing was stored while
    somebody looked. `strip` has all trials in the order of the plan, see `_strip`;
    `causes` are those of `sweep status --json`.
    """
    running = Lock(watched.place(asked.study)).owners()
    revision = watched.revision(asked.study)
    if asked.seen == revision:
        return {"revision": revision, "running": running}
    revision, study = watched.counted(asked.study)
    trials = study.trials
    counts = {str(name): int(n) for name, n in trials["status"].value_counts().items()}
    stored, planned = len(trials), int(study.plan.num_rows)
    rate = watched.rate(asked.study, stored) if running else None
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
        "causes": [one._asdict() for one in causes_of(trials)],
        "metrics": study.metrics,
        "series": study.series_metrics,
        "settings": study.headings,
        "search": phases_said(study),
    }


def _about(study: StoredStudy) -> dict[str, str]:
    """The origin of the results, in words."""
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
    """All trials of the plan as at most MOST_MARKS marks.

    A mark stands for `per` trials that follow each other, and is a number from 0 to 2:
    done, not done (one of them failed, diverged or ran out of time) or missing. `row`
    is the number of marks of a point, 0 where a mark may stand for several points.
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
    """Which trials of the plan are stored; the rows of `trials` have their order."""
    if not study.missing:
        return np.ones(study.plan.num_rows, np.bool_)
    stored = pa.array(study.trials["trial_id"], pa.string())
    there: NDArray[np.bool_] = pc.is_in(study.plan["trial_id"], stored).to_numpy()
    return there


def _together(block: NDArray[np.int64]) -> int:
    """The mark of trials that stand together: a trial that is not done shows."""
    if (block == NOT_DONE).any():
        return NOT_DONE
    return MISSING if (block == MISSING).any() else DONE
