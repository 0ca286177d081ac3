"""The command line. Data goes to stdout, progress and messages to stderr.

Exit codes: 0 fine, 1 some trials did not come to their end, 2 wrong usage or a bad spec, 130 interrupted.
Everything heavy is imported inside the commands, so that `sweep --help` answers at once.
"""

import os
import sys
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

INTERRUPTED = 130

app = typer.Typer(
    help="Monte Carlo experiments and parameter sweeps over boid swarms.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)

Spec = Annotated[Path, typer.Argument(help="The spec of a study, a YAML file.")]
StudyName = Annotated[str, typer.Argument(metavar="STUDY", help="Name of a study, e.g. nguyen2024/separation.")]
Results = Annotated[Path, typer.Option(help="Folder that holds the stored studies.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


class Over(StrEnum):
    """Which value of a metric a table shows."""

    last = "last"
    half = "half"


class Scale(StrEnum):
    """How many trials a reproduction has."""

    full = "full"
    quick = "quick"


def main() -> None:
    """The `sweep` command: errors that a user can mend become one line and exit code 2."""
    try:
        app()
    except (KeyboardInterrupt, SystemExit) as ending:
        # typer turns Ctrl-C into an exit without a word.
        if isinstance(ending, SystemExit) and ending.code != INTERRUPTED:
            raise
        _stop("interrupted; what is done is stored, and the same command goes on from there", INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has seen enough; Python would complain once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except Exception as error:
        if type(error).__name__ not in ("SpecError", "StoreError", "WorkersError"):
            raise
        _stop(str(error), 2)


def _stop(message: str, code: int) -> NoReturn:
    print(message, file=sys.stderr)
    raise SystemExit(code)


@app.command()
def launch(
    spec: Spec,
    workers: Annotated[int, typer.Option(min=0, help="Worker processes; 0 for one on each core.")] = 0,
    results: Results = Path("results"),
    retry: Annotated[bool, typer.Option(help="Run trials that failed before once more.")] = False,
) -> None:
    """Run the trials of a study that are not stored yet.

    Ctrl-C stops at once and keeps what is done; the same command goes on from there.
    """
    from sweep.executors import Loky, core_count
    from sweep.launch import launch as run_study
    from sweep.progress import ProgressBar
    from sweep.spec import load_spec

    study = load_spec(spec)
    engine = Loky(workers or core_count())
    with ProgressBar(study.name) as bar, ExitStack() as ending:
        ending.callback(engine.stop)
        progress = run_study(study, results, engine, retry=retry, report=bar.show)
    print(bar.summary(progress, results / study.name), file=sys.stderr)
    if progress.troubled:
        raise SystemExit(1)


@app.command()
def plan(
    spec: Spec,
    workers: Annotated[int, typer.Option(min=0, help="Worker processes; 0 for one on each core.")] = 0,
    as_json: Json = False,
) -> None:
    """What a spec would run: points, trials, what is rejected, and what it may cost."""
    from sweep.executors import core_count
    from sweep.plan import make_plan
    from sweep.spec import load_spec

    made = make_plan(load_spec(spec), workers or core_count())
    print(made.as_json() if as_json else made.as_text())


@app.command()
def status(study: StudyName, results: Results = Path("results"), as_json: Json = False) -> None:
    """How much of a study is stored, and what went wrong."""
    from sweep.listing import status_json, status_text
    from sweep.study import StoredStudy

    stored = StoredStudy(study, results)
    print(status_json(stored) if as_json else status_text(stored))


@app.command()
def table(
    study: StudyName,
    results: Results = Path("results"),
    metric: Annotated[list[str] | None, typer.Option(help="A metric to show; may be repeated.")] = None,
    over: Annotated[Over, typer.Option(help="The last frame, or the mean over the last half.")] = Over.last,
    csv: Annotated[bool, typer.Option("--csv", help="Print CSV.")] = False,
    as_json: Json = False,
) -> None:
    """Means of the metrics with 95 % intervals over the replicates of each point."""
    from sweep.listing import point_table, table_text
    from sweep.study import StoredStudy

    stored = StoredStudy(study, results)
    try:
        rows, names = point_table(stored, metric or [], half=over is Over.half)
    except ValueError as error:
        _stop(str(error), 2)
    if csv:
        print(rows.to_csv(index=False), end="")
    elif as_json:
        print(rows.to_json(orient="records", indent=2))
    else:
        table_text(stored, rows, names)


@app.command()
def reproduce(
    experiments: Annotated[Path, typer.Argument(help="Folder of the studies with a published.yaml.")] = Path(
        "experiments"
    ),
    only: Annotated[list[str] | None, typer.Option(help="Run and draw this study only; may be repeated.")] = None,
    scale: Annotated[Scale, typer.Option(help="All trials, or few of them as a try.")] = Scale.full,
    results: Results = Path("results"),
    workers: Annotated[int, typer.Option(min=0, help="Worker processes; 0 for one on each core.")] = 0,
) -> None:
    """Run what is missing of the published studies, draw their figures, and judge every published claim.

    The verdicts are on the page scorecard.html below the results.
    """
    from sweep.claims import read_all
    from sweep.executors import Loky, core_count
    from sweep.reproduce import reproduce as run_all

    quick = scale is Scale.quick
    publications = read_all(experiments, quick=quick)
    engine = Loky(workers or core_count())
    outcome = run_all(publications, results, engine, quick=quick, only=only or ())
    print(outcome.summary(), file=sys.stderr)
    if not outcome.whole:
        raise SystemExit(1)


@app.command()
def replay(study: StudyName, trial: str, results: Results = Path("results")) -> None:
    """Run a stored trial again, here and now, and compare it with what is stored, bit for bit.

    An exception of the trial is raised with its traceback.
    """
    from sweep.replay import replay as run_again
    from sweep.study import StoredStudy

    report, same = run_again(StoredStudy(study, results), trial)
    print(report)
    if not same:
        raise SystemExit(1)


@app.command()
def models(name: Annotated[str | None, typer.Argument(help="A model, for all its settings.")] = None) -> None:
    """The models, or the settings of one with units, ranges and preset values."""
    from sweep.listing import model_settings, model_table

    _print(model_table() if name is None else model_settings(_known(name, "model", _models())))


@app.command()
def maps() -> None:
    """The environment maps."""
    from sweep.listing import map_table

    _print(map_table())


@app.command()
def metrics() -> None:
    """The metrics, with units and sources."""
    from sweep.listing import metric_table

    _print(metric_table())


@app.command()
def schema() -> None:
    """The JSON Schema of a spec, with which editors check and complete it."""
    import json

    from sweep.schema import json_schema

    print(json.dumps(json_schema(), indent=1))


def _models() -> list[str]:
    from kernels.models import MODELS

    return list(MODELS)


def _known(name: str, what: str, names: list[str]) -> str:
    from sweep.names import unknown

    if name not in names:
        _stop(unknown(what, name, names), 2)
    return name


def _print(renderable: Any) -> None:
    from sweep.listing import console

    console().print(renderable)
