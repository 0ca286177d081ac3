"""The command that computes further metrics of stored trials."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import Group, Json, Quiet, Results, StudyName, Trust, Workers, app


@app.command(rich_help_panel=Group.analyse)
def measure(
    study: StudyName,
    metrics: Annotated[
        list[str],
        typer.Argument(
            metavar="METRIC",
            help="Name of a metric (see `sweep metrics`), file with custom metrics such"
            " as ./mine.py or ./mine.py:NAME, or expression such as 'gain ="
            " polarization / speed'.",
        ),
    ],
    workers: Workers = 0,
    results: Results = Path("results"),
    as_json: Json = False,
    quiet: Quiet = False,
    trust: Trust = False,
) -> None:
    """Compute additional metrics from stored trajectories.

    No trial runs again. The values are bitwise identical to the values of a launch that
    records the metrics. A metric that needs more than trajectories is rejected, and
    then no value is stored.

    Examples
    --------
    sweep measure my/room nearest_neighbour_distance
    sweep measure my/room "stretch = dispersion / flock_radius"
    """
    from sweep.campaigns import measure as compute
    from sweep.cli.progress_line import ProgressLine
    from sweep.spec import dump
    from sweep.text import shortened, so_many
    from sweep.workers import Loky, worker_count

    engine = Loky(worker_count(workers))
    line = ProgressLine(study, "trials measured")
    try:
        done = compute(
            study,
            metrics,
            results,
            engine,
            trust=trust,
            report=(lambda _done, _all: None) if quiet else line.show,
        )
    finally:
        engine.stop()
    if as_json:
        print(done.as_json())
    if quiet:
        return
    if not done.metrics:
        note = "an interrupted measurement is now complete, see `sweep table`"
        print(f"{study}: {note}", file=sys.stderr)
        return
    notes = [
        f"{study}: {', '.join(done.metrics)} of {so_many(done.measured, 'trial')}"
        f" measured, {done.stored:,} already stored",
    ]
    if done.left:
        notes.append(
            f"{so_many(done.left, 'trial')} not done: a launch runs these trials"
        )
    if done.measured:
        notes.append(f"sweep gc {study} removes the rows without the new metrics")
    notes.append(f"to keep the metrics, {shortened(done.path)} needs:")
    print(*notes, dump({"record": done.record}), sep="\n", end="", file=sys.stderr)
