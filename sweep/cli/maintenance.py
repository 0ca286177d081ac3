"""Commands for stored results: check, compare with a spec, clean, rename, export."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import (
    CodeFrom,
    Force,
    Group,
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

Yes = Annotated[bool, typer.Option("--yes", help="Do not ask for confirmation.")]
DryRun = Annotated[
    bool,
    typer.Option("--dry-run", help="Report what would be deleted; delete nothing."),
]


class Exportable(StrEnum):
    """The tables of a study that can be exported."""

    trials = "trials"
    series = "series"
    heatmaps = "heatmaps"
    profiles = "profiles"
    trajectories = "trajectories"


@app.command(rich_help_panel=Group.explore)
def replay(
    study: StudyName,
    trial: Annotated[
        str,
        typer.Argument(
            metavar="TRIAL", help="Id of a stored trial, or the beginning of the id."
        ),
    ],
    results: Results = Path("results"),
    trajectory: Annotated[
        Path | None,
        typer.Option(
            help="File for all frames: .parquet, or .csv with one row per frame and"
            " boid."
        ),
    ] = None,
    animate: Annotated[
        Path | None,
        typer.Option(help="File for an animation: .gif, .mp4 or .html."),
    ] = None,
    frame: Annotated[
        tuple[int, Path] | None,
        typer.Option(
            help="Number of a frame, and a .png file for an image of the frame."
        ),
    ] = None,
    every: Annotated[
        int,
        typer.Option(
            min=0,
            help=(
                "Number of steps between frames; 0 = all steps, but at most 600 frames"
                " in a GIF or MP4."
            ),
        ),
    ] = 0,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Rerun a stored trial and compare it bit for bit.

    Compares the results with the stored results. On request, writes all frames, an
    animation or an image. If the trial fails, prints the stored error and raises the
    exception with its traceback.

    Examples
    --------
    sweep replay my/first 05d7a1b2
    sweep replay my/first 05d7a1b2 --animate trial.gif
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
        print(f"{study}: the trial has failed: {cause}", file=sys.stderr, flush=True)
    report, same = run_again(stored, trial)
    print(report)
    for path in show(stored, trial, files):
        print(f"written    {path}")
    if not same:
        raise SystemExit(1)


@app.command(rich_help_panel=Group.store)
def verify(
    study: StudyName,
    fraction: Annotated[
        float,
        typer.Option(
            help="Fraction of the stored trials, from 0 to 1; at least one trial."
        ),
    ] = 0.01,
    most: Annotated[int, typer.Option(min=1, help="Maximum number of trials.")] = 1000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random sample.")] = 0,
    workers: Workers = 0,
    executor: Annotated[
        str | None,
        typer.Option(
            metavar="cpu|dask|cuda|wasm|NAME",
            autocompletion=engine_names,
            help=(
                "Engine that runs the trials: cpu, cuda, wasm, or an engine of an"
                " installed package; the sample then prefers trials of another type of"
                " device. By default cpu, with a sample of all trials."
            ),
        ),
    ] = None,
    address: Address = None,
    scheduler_file: SchedulerFile = None,
    results: Results = Path("results"),
    trust: Trust = False,
) -> None:
    """Rerun a random sample of trials and compare bit for bit.

    Compares every value of every table. The exit code is 1 if a trial differs.

    Examples
    --------
    sweep verify my/first
    sweep verify my/first --fraction 0.1 --workers 4
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


@app.command(rich_help_panel=Group.run)
def diff(
    spec: Annotated[
        Path,
        typer.Argument(
            help="Spec to compare with the last launched spec of the study."
        ),
    ],
    other: Annotated[
        Path | None, typer.Argument(help="Second spec, to compare with the first.")
    ] = None,
    results: Results = Path("results"),
    as_json: Json = False,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Show which trials a changed spec adds, keeps and drops.

    No trial runs. The numbers of points and trials are exact. A spec of several studies
    is compared study by study. With --json, prints one object per study.

    Examples
    --------
    sweep diff spec.yaml
    sweep diff spec.yaml wider.yaml --json
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


@app.command(rich_help_panel=Group.store)
def gc(
    study: StudyName,
    yes: Yes = False,
    dry_run: DryRun = False,
    results: Results = Path("results"),
) -> None:
    """Delete stored trials that the spec does not use.

    Such trials are no longer in the spec, or other versions of the code computed the
    trials. Asks for confirmation, and also merges small files of results.

    Examples
    --------
    sweep gc my/first --dry-run
    sweep gc my/first --yes
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
    """Ask whether trials may be removed, and end the command unless confirmed."""
    if not sys.stdin.isatty():
        stop(
            "nothing was removed: there is no terminal for the question; use --yes to"
            " remove, or --dry-run to list the data"
        )
    typer.confirm(
        "Remove these data? The removal cannot be undone.",
        default=False,
        abort=True,
        err=True,
    )


@app.command(rich_help_panel=Group.store)
def rename(
    study: StudyName,
    name: Annotated[str, typer.Argument(metavar="NEW", help="New name of the study.")],
    results: Results = Path("results"),
) -> None:
    """Rename a stored study.

    The stored data do not change. Write the new name into the spec too.

    Examples
    --------
    sweep rename my/first my/second
    sweep rename my/first my/second --results other
    """
    from sweep.cli.spec_files import what_the_spec_needs
    from sweep.store import rename_study
    from sweep.tables import StoredStudy

    print(rename_study(study, name, results))
    if advice := what_the_spec_needs(StoredStudy(name, results)):
        print(advice, file=sys.stderr)


@app.command(rich_help_panel=Group.store)
def rm(
    study: StudyName,
    yes: Yes = False,
    dry_run: DryRun = False,
    results: Results = Path("results"),
) -> None:
    """Delete the stored data of a study.

    Asks for confirmation. The spec and files that no launch has written stay.

    Examples
    --------
    sweep rm my/first --dry-run
    sweep rm my/first --yes
    """
    from sweep.design import size
    from sweep.store import place_of_study, remove_study, trials_in

    place = place_of_study(study, results)
    content = place.content()
    print(f"study      {study}\nlocation   {place.root}")
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


@app.command(rich_help_panel=Group.store)
def export(
    study: StudyName,
    to: Annotated[
        Path,
        typer.Option("--to", help="File to write: .parquet, .csv, .nc or .arrow."),
    ],
    table: Annotated[
        Exportable, typer.Option(help="Table to export.")
    ] = Exportable.trials,
    where: Where = None,
    trial: Annotated[
        list[str] | None,
        typer.Option(
            metavar="ID",
            help="Id of a trial, or the beginning of the id; by default all trials."
            " Repeatable.",
        ),
    ] = None,
    columns: Annotated[
        str | None,
        typer.Option(
            metavar="COLUMN[,COLUMN]",
            help=(
                "Columns to export, in addition to trial, frame and boid; by default"
                ' all columns. "varied" = parameters that differ, "metrics" = all'
                " metrics."
            ),
        ),
    ] = None,
    force: Force = False,
    results: Results = Path("results"),
) -> None:
    """Export one table of a study for other programs.

    The file is Parquet, CSV, netCDF or Arrow, with units, provenance and a checksum.

    Examples
    --------
    sweep export my/first --to trials.parquet
    sweep export my/first --to speed.csv --table series
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


@app.command(rich_help_panel=Group.analyse)
def flocks(
    study: StudyName,
    to: Annotated[
        Path,
        typer.Option("--to", help="File to write: .csv; with --changes also .parquet."),
    ],
    changes: Annotated[
        bool,
        typer.Option(
            "--changes",
            help="Table of the boids that leave or join flocks, frame by frame; needs"
            " record: {trajectories: true} in the spec.",
        ),
    ] = False,
    where: Where = None,
    force: Force = False,
    results: Results = Path("results"),
) -> None:
    """Export final states as initial conditions of a study.

    The table has the final position and velocity of each boid, in all trials of one
    point. The replicates of another study start from the table with
    `start_draws: ./FILE.csv`. The spec needs record: {last_flocks: true}, or an axis
    that is continued.

    With --changes, the table lists which boids change from flock to flock.

    Examples
    --------
    sweep flocks my/flocks --to final.csv --where noise=0.5
    sweep flocks my/flocks --to changes.parquet --changes
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
