"""The command that opens the results explorer, or writes a study as one file.

The explorer begins with the list of studies, one study, or a comparison of two sides.
"""

import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.cli.app import (
    CodeFrom,
    Force,
    Group,
    LaunchFile,
    NoCode,
    Results,
    Trust,
    Workers,
    app,
    stop,
)
from sweep.cli.completing import study_names
from sweep.cli.reporting import Where
from sweep.cli.supplementing import (
    FRAMES,
    AcrossSetting,
    Authors,
    BySetting,
    Caption,
    CitationFile,
    Compute,
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
from sweep.methods import Confidence, Correction, Margin, Over, OverOption, Together
from sweep.text import installing

if TYPE_CHECKING:
    from sweep.explorer import AskComparison
    from sweep.web import Launcher

ALWAYS = ("study", "other", "results", "trust", "to")
SERVED = ("port", "no_open", "launch")
"""Options of the explorer, which a server shows."""
LAUNCHED = ("workers", "no_code", "code_from")
"""Options of the studies that the explorer launches; a file also has workers."""
JUDGED = ("margin", "confidence", "together")
"""Options of a comparison that a file does not have."""
COMPARED = ("metric", "over", *JUDGED)
"""Options of a comparison. Options that are in no list belong to a file."""


@app.command(rich_help_panel=Group.explore)
def show(
    context: typer.Context,
    study: Annotated[
        str | None,
        typer.Argument(
            metavar="[STUDY]",
            help="Study to open; by default the list of all studies.",
            autocompletion=study_names,
        ),
    ] = None,
    other: Annotated[
        str | None,
        typer.Argument(
            metavar="[OTHER]",
            help=(
                "Side B of a comparison. Each side has the form of `sweep compare`:"
                " STUDY, STUDY:parameter=value[,...] or STUDY:PRESET."
            ),
            autocompletion=study_names,
        ),
    ] = None,
    results: Results = Path("results"),
    port: Annotated[
        int,
        typer.Option(min=0, max=65535, help="Port of the server; 0 = a free port."),
    ] = 0,
    no_open: Annotated[
        bool,
        typer.Option(
            "--no-open",
            help="Print the address and open no browser, for example on a remote"
            " machine.",
        ),
    ] = False,
    launch: LaunchFile = None,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
    to: To = None,
    metric: FigureMetric = "",
    over: OverOption = Over.last,
    margin: Margin = None,
    confidence: Confidence = 0.95,
    together: Correction = Together.holm,
    where: Where = None,
    x: AcrossSetting = "",
    by: BySetting = "",
    trials: ShownTrials = None,
    frames: Frames = FRAMES,
    compute: Compute = False,
    citation_file: CitationFile = None,
    title: Title = "",
    author: Authors = None,
    doi: Doi = "",
    licence: Licence = "",
    caption: Caption = "",
    workers: Workers = 0,
    force: Force = False,
    trust: Trust = False,
) -> None:
    """Open the results explorer, or write an interactive figure.

    The explorer has figures, tables, and the trials behind each number, which run
    again. The explorer only reads results, and follows a launch that is running. With
    two studies, or two groups of points, shows a comparison like `sweep compare`. With
    --launch, the explorer can add points to a region of a study and launch the spec,
    after a click. The server answers on this machine only. Ctrl-C ends the server.

    With --to, writes an interactive figure of one study: an HTML file of at most 16 MiB
    with confidence intervals, and a stored trial behind every point. Each of the trials
    runs again and is compared with the stored results, bit for bit. With --compute, the
    page itself runs the trials.

    Examples
    --------
    sweep show my/first
    sweep show my/first --to figure.html --metric speed
    """
    _check_options(context, study, other, to)
    if study is None or to is None:
        from sweep.explorer import AskComparison

        launcher = None
        if launch:
            options = ["--workers", str(workers)] if workers else []
            launcher = _launcher(
                launch, results, options, no_code=no_code, code_from=code_from
            )
            study = study or launcher.study
        first: AskComparison | str | None = study
        if study and other:
            first = AskComparison(
                study,
                other,
                metric=(metric,) if metric else (),
                half=over is Over.half,
                margin=margin,
                confidence=confidence,
                together=together.value,
            )
        _serve(results, first, port, launcher, trust=trust, no_open=no_open)
        return
    from sweep.explorer import PaperTexts, SupplementChoice, publication, read_cff
    from sweep.tables import StoredStudy

    check_file(to, force=force)
    named = publication(title, tuple(author or ()), doi, licence, caption=caption)
    texts = named.or_else(read_cff(citation_file) if citation_file else PaperTexts())
    choice = SupplementChoice(
        metric,
        over is Over.half,
        tuple(where or ()),
        x,
        by=by,
        trials=tuple(role.value for role in trials or [TrialRole.median]),
        frames=frames,
        compute=compute,
    )
    stored = StoredStudy(study, results, trust=trust)
    write_supplement(stored, to, choice, texts, workers=workers)
    print(to)


def _check_options(
    context: typer.Context, study: str | None, other: str | None, to: Path | None
) -> None:
    """End the command for options that exclude each other."""
    on_command_line = {
        option.name: option.opts[0]
        for option in context.command.params
        if (source := context.get_parameter_source(str(option.name)))
        and source.name == "COMMANDLINE"
    }

    def named(*names: str) -> str:
        options = on_command_line.items()
        return ", ".join(option for name, option in options if name in names)

    if other is None and (judged := named(*JUDGED)):
        stop(f"{judged}: needs two sides; use sweep show A B {judged} ...")
    if other and to:
        stop(f"--to {to}: a file shows one study, not two: {study}, {other}")
    if to is None:
        if "launch" not in on_command_line and (launched := named(*LAUNCHED)):
            stop(f"{launched}: needs --launch SPEC")
        page = (*ALWAYS, *SERVED, *LAUNCHED, *(COMPARED if other else ()))
        if of_file := named(*(on_command_line.keys() - set(page))):
            stop(f"{of_file}: needs --to FILE.html")
    elif study is None:
        stop(f"--to {to}: needs a study; use sweep show STUDY --to {to}")
    elif of_page := named(*SERVED, "no_code", "code_from"):
        stop(f"{of_page}: is for the explorer, but --to writes a file")


def _launcher(
    file: Path,
    results: Results,
    options: list[str],
    *,
    no_code: bool,
    code_from: Path | None,
) -> "Launcher":
    """Return the launcher of the spec in a file, which must exist."""
    from sweep.cli.spec_files import check_spec_file
    from sweep.own_code import load_spec
    from sweep.web import Launcher

    check_spec_file(file, results)
    options += ["--code-from", str(code_from)] if code_from else []
    read = partial(load_spec, code=not no_code, code_from=code_from)
    return Launcher(file, results, options, read=read)


def _serve(
    results: Results,
    first: "str | AskComparison | None",
    port: int,
    launcher: "Launcher | None",
    *,
    trust: bool,
    no_open: bool,
) -> None:
    try:
        from sweep.explorer import explorer

        server, url = explorer(results, first, port, trust=trust, launcher=launcher)
    except ModuleNotFoundError as error:
        needed = f"the explorer needs {error.name}, which is not installed"
        stop(f"{needed}: {installing('view')}")
    print(url, flush=True)
    print("Ctrl-C ends the server", file=sys.stderr)
    if not no_open:
        open_page(url)
    with suppress(KeyboardInterrupt):
        server.run()
    if launcher and (message := launcher.leave()):
        print(message, file=sys.stderr)
