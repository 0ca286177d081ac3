"""Commands that run trials."""

import sys
from contextlib import AbstractContextManager, nullcontext
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import (
    CodeFrom,
    Group,
    Json,
    NoCode,
    Quiet,
    Results,
    Spec,
    Workers,
    app,
    stop,
)
from sweep.cli.engines import (
    LOCAL,
    Address,
    Engine,
    SchedulerFile,
    engine,
)
from sweep.cli.page_beside import check_installed, page_beside
from sweep.errors import ChoiceError

MOST_PLANNED = 1_000_000
"""Workers of a cluster."""


class Scale(StrEnum):
    """The number of trials of a reproduction, or the kind of variants that run."""

    full = "full"
    quick = "quick"
    mutants = "mutants"
    details = "details"
    numerics = "numerics"


@app.command(rich_help_panel=Group.run)
def plan(
    spec: Spec,
    workers: Annotated[
        int,
        typer.Option(
            min=0,
            max=MOST_PLANNED,
            help="Number of workers, also of a cluster; 0 = one per core.",
        ),
    ] = 0,
    results: Results = Path("results"),
    as_json: Json = False,
    quiet: Quiet = False,  # noqa: ARG001
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Show the points, the trials and the cost of a spec.

    Prints one plan per study and per `validate` variant: points, trials, rejected
    points, and estimates of the time and the disk space. With --json, prints one object
    per plan.

    Examples
    --------
    sweep plan spec.yaml
    sweep plan spec.yaml --workers 64 --json
    """
    from sweep.campaigns import plan_of
    from sweep.cli.spec_files import check_spec_file
    from sweep.own_code import load_specs, with_variants
    from sweep.workers import worker_count

    check_spec_file(spec, results)
    specs = load_specs(spec, code=not no_code, code_from=code_from)
    plans = [
        plan_of(study, worker_count(workers), results)
        for spec_study in specs
        for study in with_variants(spec_study)
    ]
    for study_plan in plans:
        print(study_plan.as_json() if as_json else study_plan.as_text())


@app.command(rich_help_panel=Group.run)
def launch(
    spec: Spec,
    workers: Workers = 0,
    results: Results = Path("results"),
    retry: Annotated[bool, typer.Option(help="Run failed trials once more.")] = False,
    shard: Annotated[
        str | None,
        typer.Option(
            metavar="K/N",
            help="Shard to run, the K-th of N; further launches run the other shards.",
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    executor: Engine = LOCAL,
    address: Address = None,
    scheduler_file: SchedulerFile = None,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
    show: Annotated[
        bool,
        typer.Option(
            "--show",
            help="Follow the run in the results explorer in the browser, which may"
            " launch a changed spec again. The explorer stays open until Ctrl-C.",
        ),
    ] = False,
    no_open: Annotated[
        bool,
        typer.Option(
            "--no-open", help="With --show: print the address and open no browser."
        ),
    ] = False,
) -> None:
    """Run all missing trials of a spec.

    A spec of several studies runs study by study. The variants of `validate` run too.

    Ctrl-C stops at once and keeps all finished trials. The same command resumes the
    run.

    Examples
    --------
    sweep launch spec.yaml
    sweep launch spec.yaml --workers 8 --shard 1/4
    """
    from sweep.campaigns import check_flights, check_launches
    from sweep.campaigns import launch as run_study
    from sweep.cli.progress import ProgressBar, launch_json
    from sweep.cli.spec_files import check_spec_file
    from sweep.own_code import load_specs, with_variants
    from sweep.store import Share

    share = Share.parse(shard) if shard else None
    if no_open and not show:
        stop("--no-open: needs --show")
    if show:
        check_installed()
    check_spec_file(spec, results)
    specs = load_specs(spec, code=not no_code, code_from=code_from)
    studies = [study for spec_study in specs for study in with_variants(spec_study)]
    if len(studies) > 1:
        check_launches(studies, share)
    troubled = False
    page: AbstractContextManager[None] = nullcontext()
    if show:
        arguments = ["--results", str(results), *(["--no-open"] if no_open else [])]
        # The explorer launches one study, with the usual engine.
        if len(studies) == 1 and executor == LOCAL:
            arguments += ["--launch", str(spec), "--workers", str(workers)]
            arguments += ["--no-code"] if no_code else []
            arguments += ["--code-from", str(code_from)] if code_from else []
        page = page_beside(arguments)
    with page, engine(executor, workers, address, scheduler_file) as factory:
        if len(studies) > 1:
            check_flights(studies, factory)
        for study in studies:
            name = f"{study.name}, shard {share}" if share else study.name
            with ProgressBar(name, quiet=quiet) as bar:
                progress = run_study(
                    study, results, factory, retry=retry, share=share, report=bar.show
                )
            folder = results / study.name
            if not quiet:
                print(bar.summary(progress, folder), file=sys.stderr)
            if as_json:
                facts = (study.name, share, folder, progress)
                print(launch_json(*facts, seconds=bar.seconds))
            troubled |= progress.troubled > 0
    if troubled:
        raise SystemExit(1)


@app.command(rich_help_panel=Group.run)
def search(
    spec: Spec,
    workers: Workers = 0,
    results: Results = Path("results"),
    repetitions: Annotated[
        int | None,
        typer.Option(
            min=1,
            help=(
                "Number of repetitions of the search with new seeds, for a comparison"
                " with random searches; by default the number of the stored search, or"
                " no repetition."
            ),
        ),
    ] = None,
    export: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help="Optuna storage for a copy of the search, such as sqlite:///x.db; the"
            " password of a database comes from SWEEP_EXPORT_PASSWORD.",
        ),
    ] = None,
    retry: Annotated[bool, typer.Option(help="Run failed trials once more.")] = False,
    as_json: Json = False,
    quiet: Quiet = False,
    executor: Engine = LOCAL,
    address: Address = None,
    scheduler_file: SchedulerFile = None,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Search for the best parameters and validate the results.

    The spec has a section `search`. The best candidates are validated with new seeds
    (held-out trials), and the report lists candidates with confidence intervals.

    Ctrl-C stops at once and keeps all finished trials. The same command resumes the
    search.

    Examples
    --------
    sweep search gains.yaml
    sweep search gains.yaml --repetitions 5 --json
    """
    from sweep.cli.progress import ProgressBar
    from sweep.cli.reporting import print_report
    from sweep.cli.spec_files import check_spec_file
    from sweep.methods.search import check_export, search_report
    from sweep.methods.search import export as write_export
    from sweep.methods.search import search as run_search
    from sweep.own_code import load_spec
    from sweep.tables import StoredStudy

    check_spec_file(spec, results)
    study = load_spec(spec, code=not no_code, code_from=code_from)
    if export:
        check_export(export, study.name)
    with (
        engine(executor, workers, address, scheduler_file) as factory,
        ProgressBar(study.name, quiet=quiet) as bar,
    ):
        progress = run_search(
            study,
            results,
            factory,
            repetitions=repetitions,
            retry=retry,
            report=bar.show,
        )
    if not quiet:
        print(bar.summary(progress, results / study.name), file=sys.stderr)
    stored = StoredStudy(study.name, results)
    report = search_report(stored)
    if as_json:
        print(report.to_json(), end="")
    else:
        print_report(report)
    if export:
        print(
            f'{study.name}: exported to {export} as "{write_export(stored, export)}"',
            file=sys.stderr,
        )
    if progress.troubled:
        raise SystemExit(1)


@app.command(rich_help_panel=Group.run)
def reproduce(
    experiments: Annotated[
        Path | None,
        typer.Argument(
            help="Folder of studies with a published.yaml; by default the folder"
            " experiments, or the built-in studies if that folder has no such study.",
        ),
    ] = None,
    only: Annotated[
        list[str] | None,
        typer.Option(help="Study to reproduce; by default all. Repeatable."),
    ] = None,
    scale: Annotated[
        Scale,
        typer.Option(
            help="Number of trials: full, or quick for a first look. With few trials of"
            " variants of the studies: mutants, details or numerics."
        ),
    ] = Scale.full,
    variant: Annotated[
        list[str] | None,
        typer.Option(
            help="Variant to run, or a pattern such as 'n-*'; by default all."
            " Repeatable."
        ),
    ] = None,
    plan_only: Annotated[
        bool,
        typer.Option(
            "--plan",
            help="Run nothing: print the smallest difference that each claim could"
            " detect with all trials, estimated from stored trials of the scale full or"
            " quick.",
        ),
    ] = False,
    results: Results = Path("results"),
    workers: Workers = 0,
) -> None:
    """Reproduce the published studies and judge their claims.

    Only missing trials run. The verdicts are in scorecard.html in the results folder,
    with the figures.

    This runs code: figures.py of each study in the folder, and imported files from the
    folder of figures.py. With --only, only the code of the named studies runs. Read the
    code first.

    The scales "mutants", "details" and "numerics" run and judge variants of the
    studies, with few trials. Mutants are the wrong versions in published.yaml, and
    mistakes in a copy of the program. Details are changes of each number by 2 and 10 %,
    and each component of further presets. Numerics are half the time step, the opposite
    update order, and a new seed. The command prints the changed verdicts and stores the
    verdicts in variants.json in the results folder.

    With --plan, a claim is weak if the detectable difference exceeds the margin. The
    command then prints the number of trials that the claim needs.

    Examples
    --------
    sweep reproduce --only nguyen2024 --scale quick
    sweep reproduce --plan
    """
    from sweep.cli.progress import ProgressBar
    from sweep.published import (
        FILE,
        KINDS,
        chosen_variants,
        code_files,
        most_trials,
        outlook_lines,
        outlooks,
        read_all,
        try_all,
    )
    from sweep.published import reproduce as run_all
    from sweep.spec import EXPERIMENTS
    from sweep.store import local_folder
    from sweep.workers import Loky, worker_count

    folder = local_folder(results, "the page and its figures are written to")
    quick = scale is not Scale.full
    kind = next((name for name in KINDS if name == scale), None)
    if variant and kind is None:
        allowed = " or ".join(KINDS)
        raise ChoiceError(f"--variant needs --scale {allowed}, not {scale}")
    if plan_only and scale is not Scale.full:
        raise ChoiceError(f"--plan needs --scale full, not {scale}")
    if experiments is None:
        experiments = Path(EXPERIMENTS.name)
        if not any(experiments.glob(f"*/{FILE}")):
            print(
                f"no folder in {experiments} has a {FILE}: the built-in studies are"
                f" reproduced, into {folder}",
                file=sys.stderr,
            )
            experiments = EXPERIMENTS
    files = code_files(experiments, only or ())
    if files and experiments.resolve() != EXPERIMENTS:
        print(f"this runs code: {', '.join(map(str, files))}", file=sys.stderr)
    publications = read_all(experiments, quick=quick, only=only or ())
    if plan_only:
        few = read_all(experiments, quick=True, only=only or ())
        for full, pilot in zip(publications, few, strict=True):
            if full.selected:
                foreseen = outlooks(full, pilot, folder)
                print(*outlook_lines(full.name, foreseen), sep="\n")
        return
    engine = Loky(worker_count(workers))
    if kind:
        chosen = chosen_variants(publications, kind, variant or ())
        tried = sum(len(variants) for _, variants in chosen)
        most = most_trials(chosen)
        trials = f"{most:,} trials minus stored trials"
        print(f"{tried:,} variants, with {trials}", file=sys.stderr)
        for name, verdicts in try_all(chosen, folder, engine, ProgressBar).items():
            print(f"{name}: {verdicts.summary(kind)}")
        return
    outcome = run_all(publications, folder, engine, ProgressBar, quick=quick)
    print(outcome.summary(), file=sys.stderr)
    if not outcome.whole:
        raise SystemExit(1)
