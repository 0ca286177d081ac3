"""What the first picture of a study of a million trials costs the explorer."""

import tempfile
import time
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from sweep.explorer.site import site_of
from sweep.explorer.watching import Watched
from sweep.store.memory import keep
from tests.bench.scale import FULL, Scale
from tests.many_trials import many_trials

ACROSS, UP, REPLICATES = 100, 100, 100
COLUMNS = [
    *("trial_id", "point", "model", "preset", "replicate", "status", "error"),
    *("separation_weight", "alignment_weight", "speed", "speed_mean"),
]
"""What the state and the figure of one metric are made of."""


def explorer(scale: Scale = FULL) -> None:
    """The processor time of the answers to the first questions of the page, by that of
    reading the same columns from the files and into a frame, in no order.
    """
    with tempfile.TemporaryDirectory() as folder:
        study = many_trials(Path(folder), ACROSS, UP, scale.of(REPLICATES))
        files = sorted(Path(folder).rglob("trials.parquet"))
        plain = _seconds(
            lambda: [pq.read_table(one, columns=COLUMNS).to_pandas() for one in files]
        )
        keep()  # as the server does
        answers = site_of(Watched(Path(folder))).answers
        asked = [("study", study.name)]
        one = [*asked, ("metric", "speed")]
        for what, question, pairs in (
            ("the state", "state", asked),
            ("the first figure", "figure", one),
            ("the table of points", "points", one),
            ("another metric", "figure", [*asked, ("metric", "dispersion")]),
        ):
            took = _seconds(lambda: answers[question](pairs))  # noqa: B023
            print(
                f"explorer, {study.plan.num_rows:,} trials, {what:20} {took:.2f} s of"
                f" processor time, {took / plain:.1f} times plain reading"
            )


def _seconds(work: Any) -> float:
    """The processor time of it, in all threads."""
    began = time.process_time()
    work()
    return time.process_time() - began
