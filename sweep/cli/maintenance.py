"""Commands for stored results: check, compare with a spec, clean, rename, export."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import (
    CodeFrom,
    Force,
    Json,
    NoCode,
    Results,
    StudyName,
    Trust,
    Workers,
    app,
    stop,
)
from sweep.cli.engines import LOCAL, Address, SchedulerFile, engine, engine_names
from sweep.cli.reporting import Where
from sweep.text import so_many

Yes = Annotated[bool, typer.Option("--yes", help="Do not ask.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Only say what would go.")]


class Exportable(StrEnum):
    """The tables of a study that a file can have."""

    trials = "trials"
    series = "series"
    heatmaps = "heatmaps"
    trajectories = "trajectories"


@app.command()
def replay(
    study: StudyName,
    trial: Annotated[
        str,
        typer.Argument(
            metavar="TRIAL", help="The id of a trial, as in its row, or its beginning."
        ),
    ],
    results: Results = Path("results"),
    trajectory: Annotated[
        Path | None,
        typer.Option(
            help="Write every frame to this .parquet file, or to a .csv file with a row"
            " a frame and boid."
        ),
    ] = None,
    animate: Annotated[
        Path | None,
        typer.Option(
            help="Write an animation to this .gif or .mp4 file, or a page to .html."
        ),
    ] = None,
    frame: Annotated[
        tuple[int, Path] | None,
        typer.Option(
            help="Write the picture of one frame: its number and a .png file."
        ),
    ] = None,
    every: Annotated[
        int,
        typer.Option(
            min=0,
            help=(
                "Steps between frames; 0: all of them, and at most 600 in a GIF or MP4."
            ),
        ),
    ] = 0,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Run a stored trial again, here and now, and compare it bit for bit.

    It is compared with what is stored. It can be written at full resolution and shown.
    An exception of the trial is raised with its traceback, and what is stored of it is
    said before.
    """
    from sweep.cli.replay_files import ReplayFiles, check, show
    from sweep.replays import replay as run_again
    from sweep.tables import StoredStudy
    from sweep.workers import in_a_line

    files = ReplayFiles(trajectory, animate, frame, every)
    stored = StoredStudy(study, results, trust=trust)
    check(stored, trial, files, force=force)
    row = stored.trial(trial).row
    if row["status"] == "failed":
        cause = in_a_line(str(row["error"]))
        print(f"{study}: this trial has failed: {cause}", file=sys.stderr, flush=True)
    report, same = run_again(stored, trial)
    print(report)
    for path in show(stored, trial, files):
        print(f"written    {path}")
    if not same:
        raise SystemExit(1)


@app.command()
def verify(
    study: StudyName,
    fraction: Annotated[
        float,
        typer.Option(
            help="Part of the stored trials, from 0 to 1; at least one trial."
        ),
    ] = 0.01,
    most: Annotated[int, typer.Option(min=1, help="At most so many trials.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sample.")] = 0,
    workers: Workers = 0,
    executor: Annotated[
        str | None,
        typer.Option(
            metavar="cpu|dask|cuda|NAME",
            autocompletion=engine_names,
            help=(
                "Where they fly again, processors or another engine; the sample is then"
                " of trials that flew elsewhere, where there are such. By default on"
                " processors, and of all trials."
            ),
        ),
    ] = None,
    address: Address = None,
    scheduler_file: SchedulerFile = None,
    results: Results = Path("results"),
    trust: Trust = False,
) -> None:
    """Run a random sample of the stored trials again and compare every bit.

    The exit code is 1 where one differs.
    """
    from sweep.cli.progress_line import ProgressLine
    from sweep.replays import verify as check
    from sweep.tables import StoredStudy

    with engine(executor or LOCAL, workers, address, scheduler_file) as factory:
        verification = check(
            StoredStudy(study, results, trust=trust),
            factory,
            fraction=fraction,
            most=most,
            seed=seed,
            elsewhere=executor is not None,
            report=ProgressLine(study, "trials compared").show,
        )
    print(verification.as_text())
    if not verification.same:
        raise SystemExit(1)


@app.command()
def diff(
    spec: Annotated[
        Path,
        typer.Argument(help="A spec: what it changes of its study as last launched."),
    ],
    other: Annotated[
        Path | None, typer.Argument(help="Or what this spec changes of the first.")
    ] = None,
    results: Results = Path("results"),
    as_json: Json = False,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Show what a change of a spec adds, keeps and drops, before any trial runs.

    Points and trials are counted exactly. Of a spec of several studies each is
    compared, with --json in an object each.
    """
    from sweep.cli.spec_files import check_spec_file
    from sweep.own_code import load_spec, load_specs
    from sweep.tables import StoredStudy, compare

    for file in filter(None, (spec, other)):
        check_spec_file(file, results)
    if other:
        before, after = (
            load_spec(path, code=not no_code, code_from=code_from)
            for path in (spec, other)
        )
        differences = [compare(before, after, results)]
    else:
        studies = load_specs(spec, code=not no_code, code_from=code_from)
        differences = [
            compare(StoredStudy(study.name, results), study, results)
            for study in studies
        ]
    for difference in differences:
        print(difference.as_json() if as_json else difference.as_text())


@app.command()
def gc(
    study: StudyName,
    yes: Yes = False,
    dry_run: DryRun = False,
    results: Results = Path("results"),
) -> None:
    """Free space: drop trials that have left the spec or are of other kernels.

    It asks before, and merges parts too.
    """
    from sweep.design import size
    from sweep.tables import StoredStudy, clean, find_waste

    stored = StoredStudy(study, results)
    waste = find_waste(stored)
    print(waste.as_text(stored))
    if dry_run:
        return
    if waste.lasting and not yes:
        _ask_to_remove()
    print(f"freed      {size(clean(stored, waste))}")


def _ask_to_remove() -> None:
    """Ask whether trials may be removed, and end the command if they may not."""
    if not sys.stdin.isatty():
        stop(
            "nothing was removed: there is no terminal to ask in; --yes removes it,"
            " --dry-run only says what"
        )
    typer.confirm(
        "Remove it? It cannot be undone.", default=False, abort=True, err=True
    )


@app.command()
def rename(
    study: StudyName,
    name: Annotated[str, typer.Argument(metavar="NEW", help="Its new name.")],
    results: Results = Path("results"),
) -> None:
    """Give a stored study another name; all that is stored of it stays as it is."""
    from sweep.cli.spec_files import what_the_spec_needs
    from sweep.store import rename_study
    from sweep.tables import StoredStudy

    print(rename_study(study, name, results))
    if advice := what_the_spec_needs(StoredStudy(name, results)):
        print(advice, file=sys.stderr)


@app.command()
def rm(
    study: StudyName,
    yes: Yes = False,
    dry_run: DryRun = False,
    results: Results = Path("results"),
) -> None:
    """Delete all that is stored of a study, after asking; its spec stays."""
    from sweep.design import size
    from sweep.store import place_of_study, remove_study, trials_in

    place = place_of_study(study, results)
    content = place.content()
    print(f"study      {study}\nplace      {place.root}")
    print(f"go         {trials_in(place):,} stored trials")
    for name, count in content.items():
        print(f"go         {name}: {size(count)}")
    if dry_run:
        return
    if not yes:
        _ask_to_remove()
    left = remove_study(study, results)
    print(f"freed      {size(sum(content.values()))}")
    if left:
        print(f"stay       {', '.join(left)}, which no launch has written")


@app.command()
def export(
    study: StudyName,
    to: Annotated[
        Path,
        typer.Option("--to", help="A .parquet, .csv, .nc (netCDF) or .arrow file."),
    ],
    table: Annotated[Exportable, typer.Option(help="Which table.")] = Exportable.trials,
    where: Where = None,
    trial: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID",
            help="Only this trial: its id, or its beginning. Repeatable.",
        ),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN[,COLUMN]",
            help=(
                "Only these columns, beside which trial, frame and boid a row is of;"
                ' "varied": settings that differ, "metrics": values of metrics.'
            ),
        ),
    ] = None,
    force: Force = False,
    results: Results = Path("results"),
) -> None:
    """Write one table as one file for other programs.

    The file has units, provenance and a checksum.
    """
    from sweep.tables import StoredStudy
    from sweep.tables import export as write

    done = write(
        StoredStudy(study, results).where(*(where or ())),
        to,
        table.value,
        trials=trial or (),
        columns=[name.strip() for name in columns.split(",")] if columns else (),
        force=force,
    )
    print(
        f"{so_many(done.rows, 'row')} of {table.value} in"
        f" {', '.join(map(str, done.files))}",
        file=sys.stderr,
    )
    print(f"{done.sha256}  {to}")


@app.command()
def flocks(
    study: StudyName,
    to: Annotated[
        Path, typer.Option("--to", help="A .csv file; of changes .parquet too.")
    ],
    changes: Annotated[
        bool,
        typer.Option(
            "--changes",
            help="Write who left which flock and joined which, frame by frame, instead."
            " The study keeps what this needs with record: {trajectories: true}.",
        ),
    ] = False,
    where: Where = None,
    force: Force = False,
    results: Results = Path("results"),
) -> None:
    """Write where the boids of each trial of a point are at the end, as a table.

    The replicates of another study start from it: `start_draws: ./FILE.csv`. The study
    keeps them with record: {last_flocks: true}, or with an axis that is continued. With
    --changes it is a table of who changes from flock to flock.
    """
    from sweep.tables import StoredStudy, write_flock_changes, write_last_flocks

    chosen = StoredStudy(study, results).where(*(where or ()))
    if changes:
        written = write_flock_changes(chosen, to, force=force)
        print(
            f"{so_many(written.rows, 'change')} of flock in {to}; in"
            f" {so_many(written.trials, 'trial')} flocks parted"
            f" {so_many(written.fissions, 'time')} and joined"
            f" {so_many(written.fusions, 'time')}",
            file=sys.stderr,
        )
        return
    done = write_last_flocks(chosen, to, force=force)
    print(
        f"{done.replicates:,} flocks of {done.boids:,} boids in {to}", file=sys.stderr
    )
