"""The command that opens the live simulator."""

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated
from urllib.parse import urlsplit

import typer

from sweep.cli.app import (
    CodeFrom,
    Force,
    Group,
    LaunchFile,
    NoCode,
    Results,
    Trust,
    app,
    stop,
)
from sweep.cli.completing import model_names
from sweep.spec import SPEC_ENDINGS
from sweep.text import installing

if TYPE_CHECKING:
    from sweep.spec import Study
    from sweep.tables import StoredStudy, StoredTrial
    from sweep.web import Show, ViewState

REPLICATES = 3
"""Trials in a page that computes them, if the seed is free."""


@app.command(rich_help_panel=Group.explore)
def view(
    source: Annotated[
        str | None,
        typer.Argument(
            metavar="[SPEC | STUDY | LINK]",
            help="Spec or stored study, shown from its first point, or an address of"
            " Copy as link; by default a page of demos.",
        ),
    ] = None,
    trial: Annotated[
        str | None,
        typer.Argument(
            metavar="[TRIAL]",
            help="Stored trial to replay: its id, or the beginning of the id.",
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            autocompletion=model_names,
            help="Model, or file with a model such as ./NAME.py; by default the first"
            " of `sweep models`.",
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(
            help="Preset of the model; by default as_run, or the first preset."
        ),
    ] = None,
    map_name: Annotated[
        str | None,
        typer.Option("--map", help="Map; by default the map of the preset."),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="Value of a parameter, such as n=50. Repeatable.",
        ),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to",
            metavar="FILE.html",
            help="File for a page that runs the first trials in the browser of the"
            " reader, without a server (extra wasm).",
        ),
    ] = None,
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
    results: Results = Path("results"),
    launch: LaunchFile = None,
    force: Force = False,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
    trust: Trust = False,
) -> None:
    """Open the live simulator in the browser.

    Shows demos, a model, a spec, a study, or a stored trial that runs again. The server
    answers on this machine only. Ctrl-C ends the server. With --to, the command writes
    a file instead, which needs neither server nor Python.

    Examples
    --------
    sweep view --model nguyen2024 --set n=50
    sweep view spec.yaml
    sweep view --model vicsek1995 --to swarm.html
    """
    if source and (model or preset or map_name):
        stop(
            f"--model, --preset and --map exclude {source}, which has a model, a preset"
            " and a map"
        )
    if source and trial and _is_spec(source):
        stop(
            f"{source} is a spec, but {trial} is a trial of a study;"
            f" use sweep view STUDY {trial}"
        )
    link = source if source and _is_link(source) else ""
    if link and (trial or settings or launch):
        stop("an address of Copy as link excludes a trial, --set and --launch")
    if to and (trial or launch):
        stop("--to writes a page of first trials, and excludes a trial and --launch")
    if force and not to:
        stop("--force replaces the file of --to, which is missing")
    if launch:
        _check_launch(launch, source, model)
    if trial and settings:
        stop("--set is for a live run; the parameters of a stored trial are fixed")
    try:
        from sweep.explorer import Watched, site_of
        from sweep.web import Launcher, PageServer, PageSite
    except ModuleNotFoundError as error:
        needed = f"the live simulator needs {error.name}, which is not installed"
        stop(f"{needed}: {installing('view')}")
    catalogue = None
    if source and trial:
        begin = _replayed(_stored(source, results, trust), trial)
    else:
        if source:
            allowed = {"trust": trust, "code": not no_code}
            state = _state_of(source, results, **allowed, code_from=code_from)
        else:
            state = _chosen(model, preset, map_name, code=not no_code)
        catalogue = state.catalogue
        state = _with(settings, state)
        if to:
            _write_page(state, to, force=force)
            return
        begin = _live(state)
    chosen = source or model or preset or map_name or settings
    launcher = None
    site = PageSite()
    if launch and catalogue:
        read = partial(_spec_of, code=not no_code, code_from=code_from)
        options = ["--code-from", str(code_from)] if code_from else []
        launcher = Launcher(launch, results, options, catalogue=catalogue, read=read)
        explorer = site_of(Watched(results, trust=trust), launcher)
        site = explorer._replace(home=site.home)
    server = PageServer(_first_at_once(begin) if chosen else begin, port, site)
    address = server.url if chosen else server.start
    if link:
        address = f"{server.url}#{urlsplit(link).fragment}"
    print(address, flush=True)
    print("Ctrl-C ends the server", file=sys.stderr)
    if not no_open:
        open_page(address)
    with suppress(KeyboardInterrupt):
        server.run()
    if launcher and (message := launcher.leave()):
        print(message, file=sys.stderr)


def _write_page(state: "ViewState", to: Path, *, force: bool) -> None:
    """Write a page that computes REPLICATES trials of the state of a simulator."""
    from kernels.catalogue import BUILT_IN
    from sweep.cli.progress_line import ProgressLine
    from sweep.cli.supplementing import check_file, computed_page
    from sweep.own_code import study_of
    from sweep.tables import unfinished
    from sweep.workers import Loky, core_count

    check_file(to, force=force)
    if state.catalogue is not BUILT_IN:
        stop(
            f"--to {to}: only without custom code; launch a study, and use sweep show"
            f" STUDY --to {to} --compute"
        )
    spec = state.as_spec()
    if "seeds" not in spec:
        spec["replicates"] = max(spec["replicates"], REPLICATES)
    engine = Loky(core_count())
    try:
        page = computed_page(
            study_of(spec),
            f"The model {state.model}",
            engine,
            ProgressLine(str(to), "trials").show,
        )
    finally:
        engine.stop()
    with unfinished(to) as file:
        file.write(page)
    print(to)


def _check_launch(file: Path, source: str | None, model: str | None) -> None:
    """End the command if the simulator cannot launch from a file.

    The simulator also may not replace a spec that is not open.
    """
    if source and not _is_spec(source):
        stop(
            f"--launch {file}: {source} is a stored study; use sweep show {source}"
            " --launch SPEC"
        )
    named = Path((source or model or "").partition(":")[0])
    home = named.parent
    if named.is_file() and file.resolve().parent != home.resolve():
        stop(
            f"--launch {file}: must be in the folder {home}, because a spec names files"
            " in its folder"
        )
    if file.exists() and (source is None or not file.samefile(source)):
        stop(
            f"--launch {file}: exists already; open the file with sweep view {file}"
            f" --launch {file}, or name a new file"
        )


def _spec_of(file: Path, *, code: bool, code_from: Path | None) -> "Study":
    from sweep.own_code import load_spec

    return load_spec(file, code=code, code_from=code_from)


def _first_at_once(begin: "Callable[[], Show]") -> "Callable[[], Show]":
    """Return a function that makes a show for each page.

    The first show is made now, so that a mistake is reported before the page opens.
    """
    first = [begin()]
    return lambda: first.pop() if first else begin()


def _stored(study: str, results: Results, trust: bool) -> "StoredStudy":
    from sweep.tables import StoredStudy

    return StoredStudy(study, results, trust=trust)


def _replayed(stored: "StoredStudy", trial: str) -> "Callable[[], Show]":
    from sweep.web import Replay

    _of_then(stored, trial)
    return lambda: Replay(stored, trial)


def _of_then(stored: "StoredStudy", trial: str) -> "StoredTrial":
    """Return a stored trial, and print the files next to the spec that have changed."""
    stored_trial = stored.trial(trial)
    for path in stored.other_now(stored_trial):
        print(f"{path}: another file now; the original code runs", file=sys.stderr)
    return stored_trial


def _live(state: "ViewState") -> "Callable[[], Show]":
    from sweep.web import Live

    return lambda: Live(state)


def _chosen(
    model: str | None, preset: str | None, map_name: str | None, *, code: bool
) -> "ViewState":
    """Return the state that shows a built-in model, or a model of a file."""
    from kernels.catalogue import BUILT_IN
    from sweep.own_code import named_model
    from sweep.web import begin

    name, catalogue = named_model(model, code=code) if model else (None, BUILT_IN)
    state = begin(name, preset, catalogue=catalogue)
    return state.with_settings({"map": map_name}) if map_name else state


def _with(settings: list[str] | None, state: "ViewState") -> "ViewState":
    """Return the state with parameters, each NAME=VALUE as in a spec."""
    from sweep.spec import parse_document

    changes: dict[str, object] = {}
    for text in settings or ():
        name, equals, value = text.partition("=")
        if not equals:
            stop(f"--set {text}: must be NAME=VALUE, such as --set n=50")
        changes |= parse_document(f"{name}: {value}", Path("--set")).value
    return state.with_settings(changes) if changes else state


def _is_link(source: str) -> bool:
    return source.startswith(("http://", "https://"))


def _is_spec(source: str) -> bool:
    return source.endswith(SPEC_ENDINGS) or Path(source).is_file()


def _state_of(
    source: str, results: Results, *, trust: bool, code: bool, code_from: Path | None
) -> "ViewState":
    """Return the state of a link, or the first of a spec or of a study.

    For a spec of several studies, the first study is shown. For a stored study, the
    simulator can choose among all trials of the spec.
    """
    from sweep.errors import StoreError
    from sweep.own_code import load_specs
    from sweep.web import from_link, from_stored, from_study

    if _is_link(source):
        return from_link(source)
    if _is_spec(source):
        return from_study(load_specs(Path(source), code=code, code_from=code_from)[0])
    study = _stored(source, results, trust)
    if study.trials.empty:
        raise StoreError(f"study {source}: no trial is stored yet")
    job = study.job(_of_then(study, study.trials["trial_id"].iloc[0]))
    return from_stored(study, job)


def open_page(url: str) -> None:
    """Open an address in the browser."""
    import webbrowser

    webbrowser.open(url)
