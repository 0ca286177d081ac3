"""The command that opens the results explorer, or writes a study as one file."""

import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.cli.app import (
    CodeFrom,
    Force,
    LaunchFile,
    NoCode,
    Results,
    Trust,
    Workers,
    app,
    stop,
)
from sweep.cli.completing import study_names
from sweep.cli.reading import Over, Where
from sweep.cli.supplementing import (
    FRAMES,
    About,
    AcrossSetting,
    Authors,
    BySetting,
    Caption,
    Doi,
    FigureMetric,
    Frames,
    Licence,
    ShownTrials,
    Title,
    To,
    TrialRole,
    check_file,
    write_supplement,
)
from sweep.cli.viewing import open_page
from sweep.text import installing

if TYPE_CHECKING:
    from sweep.web.launching import Launcher

BOTH = ("study", "results", "trust", "to", "workers")
SERVED = ("port", "no_open", "launch", "no_code", "code_from")
"""Options of a page that is served; all others are of a file."""


@app.command()
def show(
    context: typer.Context,
    study: Annotated[
        str | None,
        typer.Argument(
            metavar="[STUDY]",
            help="The study to begin with; else the list of all.",
            autocompletion=study_names,
        ),
    ] = None,
    results: Results = Path("results"),
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to serve at; 0 for a free one.")
    ] = 0,
    no_open: Annotated[
        bool,
        typer.Option(
            "--no-open", help="Only print the address, as for a remote machine."
        ),
    ] = False,
    launch: LaunchFile = None,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
    to: To = None,
    metric: FigureMetric = "",
    over: Annotated[
        Over, typer.Option(help="The last frame, or the mean over the last half.")
    ] = Over.last,
    where: Where = None,
    x: AcrossSetting = "",
    by: BySetting = "",
    trials: ShownTrials = None,
    frames: Frames = FRAMES,
    about: About = None,
    title: Title = "",
    author: Authors = None,
    doi: Doi = "",
    licence: Licence = "",
    caption: Caption = "",
    workers: Workers = 0,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Explore results in the browser: tables, figures, and each trial behind them,
    played again.

    It only reads, and follows a launch that is running. The page is served to this
    machine only. Ctrl-C ends it. With --launch it may put more points into a region of
    the study of a spec, and launch that, when you say so.

    With --to it writes one study for readers instead, as one file of at most 16 MiB:
    its figure with intervals, and behind every point a stored trial that plays. Each of
    these trials is run again and compared with what is stored, bit for bit.
    """
    _check_options(context, study, to)
    if study is None or to is None:
        launcher = None
        if launch:
            options = ["--workers", str(workers)] if workers else []
            launcher = _launcher(launch, results, options, no_code, code_from)
            study = study or launcher.study
        _serve(results, study, port, launcher, trust=trust, no_open=no_open)
        return
    from sweep.explorer.publication import PaperTexts, publication, read_cff
    from sweep.explorer.supplement import SupplementChoice
    from sweep.tables.stored_study import StoredStudy

    check_file(to, force=force)
    given = publication(title, tuple(author or ()), doi, licence, caption)
    texts = given.or_else(read_cff(about) if about else PaperTexts())
    roles = tuple(one.value for one in trials or [TrialRole.median])
    choice = SupplementChoice(
        metric, over is Over.half, tuple(where or ()), x, by, roles, frames
    )
    write_supplement(
        StoredStudy(study, results, trust=trust), to, choice, texts, workers
    )
    print(to)


def _check_options(context: typer.Context, study: str | None, to: Path | None) -> None:
    """End the command for options that do not go together."""
    given = {
        option.name: f"--{str(option.name).replace('_', '-')}"
        for option in context.command.params
        if (source := context.get_parameter_source(str(option.name)))
        and source.name == "COMMANDLINE"
    }
    if to is None:
        of_file = [text for name, text in given.items() if name not in BOTH + SERVED]
        if of_file:
            stop(f"{', '.join(of_file)}: for a file; add --to FILE.html")
    elif study is None:
        stop(f"--to {to}: of which study? sweep show STUDY --to {to}")
    elif of_page := [text for name, text in given.items() if name in SERVED]:
        stop(f"{', '.join(of_page)}: for a page that is served, and --to writes a file")


def _launcher(
    file: Path,
    results: Results,
    options: list[str],
    no_code: bool,
    code_from: Path | None,
) -> "Launcher":
    """What launches the spec in a file, which must be there."""
    from sweep.cli.spec_files import check_spec_file
    from sweep.own_code.reading import load_spec
    from sweep.web.launching import Launcher

    check_spec_file(file, results)
    options += ["--code-from", str(code_from)] if code_from else []
    read = partial(load_spec, code=not no_code, code_from=code_from)
    return Launcher(file, results, options, read=read)


def _serve(
    results: Results,
    study: str | None,
    port: int,
    launcher: "Launcher | None",
    *,
    trust: bool,
    no_open: bool,
) -> None:
    try:
        from sweep.explorer.site import explorer
    except ModuleNotFoundError as error:
        needed = f"the explorer needs {error.name}, which is not installed"
        stop(f"{needed}: {installing('view')}")
    server, url = explorer(results, study, port, trust=trust, launcher=launcher)
    print(url, flush=True)
    print("Ctrl-C ends it", file=sys.stderr)
    if not no_open:
        open_page(url)
    with suppress(KeyboardInterrupt):
        server.run()
    if launcher and (said := launcher.leave()):
        print(said, file=sys.stderr)
