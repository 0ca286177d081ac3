"""The command that opens the live simulator."""

import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.cli.app import CodeFrom, LaunchFile, NoCode, Results, Trust, app, stop
from sweep.cli.completing import model_names
from sweep.spec.study_folder import SPEC_ENDINGS
from sweep.text import installing

if TYPE_CHECKING:
    from sweep.spec.study import Study
    from sweep.tables.stored_study import StoredStudy
    from sweep.tables.stored_trials import StoredTrial
    from sweep.web.show import Show
    from sweep.web.state import ViewState


@app.command()
def view(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="[SPEC | STUDY]",
            help="A spec or a study, of which the first point is shown; without one, a"
            " page of demos.",
        ),
    ] = None,
    trial: Annotated[
        str | None,
        typer.Argument(
            metavar="[TRIAL]",
            help="A stored trial of the study to replay: its id, or its beginning.",
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            autocompletion=model_names,
            help="A model, or a file that has one: ./NAME.py; by default the first of"
            " `sweep models`.",
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(help="A preset of it; by default as_run, or its first."),
    ] = None,
    map_name: Annotated[
        str | None, typer.Option("--map", help="A map; that of the preset by default.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE",
            help="A setting: n=50; may be given several times.",
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Port to serve at; 0 for a free one.")
    ] = 0,
    no_open: Annotated[
        bool,
        typer.Option(
            "--no-open", help="Only print the address, as for a remote machine."
        ),
    ] = False,
    results: Results = Path("results"),
    launch: LaunchFile = None,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
    trust: Trust = False,
) -> None:
    """See the swarm in the browser: demos, a model, a spec or study from its first
    point, or a stored trial again.

    The page is served to this machine only. Ctrl-C ends it.
    """
    if what and (model or preset or map_name):
        stop(
            f"--model, --preset and --map are for a view without {what},"
            " which has its own"
        )
    if what and trial and _is_spec(what):
        stop(
            f"{what} is a spec, and {trial} the trial of a study:"
            f" sweep view STUDY {trial}"
        )
    if launch:
        _check_launch(launch, what, model)
    if trial and settings:
        stop("--set is for a live run, and a stored trial has its settings")
    try:
        from sweep.explorer.site import site_of
        from sweep.explorer.watching import Watched
        from sweep.web.launching import Launcher
        from sweep.web.rooms import PageSite
        from sweep.web.server import PageServer
    except ModuleNotFoundError as error:
        needed = f"the live simulator needs {error.name}, which is not installed"
        stop(f"{needed}: {installing('view')}")
    known = None
    if what and trial:
        begin = _replayed(_stored(what, results, trust), trial)
    elif what:
        allowed = {"trust": trust, "code": not no_code}
        state = _state_of(what, results, **allowed, code_from=code_from)
        known, begin = state.known, _live(_with(settings, state))
    else:
        state = _chosen(model, preset, map_name, code=not no_code)
        known, begin = state.known, _live(_with(settings, state))
    asked = what or model or preset or map_name or settings
    launcher, site = None, PageSite()
    if launch and known:
        read = partial(_spec_of, code=not no_code, code_from=code_from)
        options = ["--code-from", str(code_from)] if code_from else []
        launcher = Launcher(launch, results, options, known=known, read=read)
        explorer = site_of(Watched(results, trust=trust), launcher)
        site = explorer._replace(home=site.home)
    server = PageServer(_first_at_once(begin) if asked else begin, port, site)
    address = server.url if asked else server.start
    print(address, flush=True)
    print("Ctrl-C ends it", file=sys.stderr)
    if not no_open:
        open_page(address)
    with suppress(KeyboardInterrupt):
        server.run()
    if launcher and (said := launcher.leave()):
        print(said, file=sys.stderr)


def _check_launch(file: Path, what: str | None, model: str | None) -> None:
    """End the command where the page could not launch what it shows from this file, or
    would replace a spec that nobody has opened.
    """
    if what and not _is_spec(what):
        stop(f"--launch {file}: {what} is stored: sweep show {what} --launch SPEC")
    named = Path((what or model or "").partition(":")[0])
    home = named.parent
    if named.is_file() and file.resolve().parent != home.resolve():
        stop(
            f"--launch {file}: must lie in the folder {home}: what a spec names is"
            " looked for beside it"
        )
    if file.exists() and (what is None or not file.samefile(what)):
        stop(
            f"--launch {file}: is there already; open it, sweep view {file} --launch"
            f" {file}, or name a new file"
        )


def _spec_of(file: Path, *, code: bool, code_from: Path | None) -> "Study":
    from sweep.own_code.reading import load_spec

    return load_spec(file, code=code, code_from=code_from)


def _first_at_once(begin: "Callable[[], Show]") -> "Callable[[], Show]":
    """A function that makes a show for each page. The first show is made now, so that a
    mistake is reported before the page opens.
    """
    made = [begin()]
    return lambda: made.pop() if made else begin()


def _stored(study: str, results: Results, trust: bool) -> "StoredStudy":
    from sweep.tables.stored_study import StoredStudy

    return StoredStudy(study, results, trust=trust)


def _replayed(stored: "StoredStudy", trial: str) -> "Callable[[], Show]":
    from sweep.web.replaying import Replay

    _of_then(stored, trial)
    return lambda: Replay(stored, trial)


def _of_then(stored: "StoredStudy", trial: str) -> "StoredTrial":
    """A stored trial; which files beside the spec are other ones now is said."""
    found = stored.trial(trial)
    for path in stored.other_now(found):
        print(f"{path}: another file now; this is by that of then", file=sys.stderr)
    return found


def _live(state: "ViewState") -> "Callable[[], Show]":
    from sweep.web.live import Live

    return lambda: Live(state)


def _chosen(
    model: str | None, preset: str | None, map_name: str | None, *, code: bool
) -> "ViewState":
    """The state that shows a model, which may be one of a file."""
    from kernels.catalogue import BUILT_IN
    from sweep.own_code.reading import named_model
    from sweep.web.state import begin

    name, known = named_model(model, code=code) if model else (None, BUILT_IN)
    state = begin(name, preset, known=known)
    return state.with_settings({"map": map_name}) if map_name else state


def _with(settings: list[str] | None, state: "ViewState") -> "ViewState":
    """The state with these settings, each NAME=VALUE as a spec writes it."""
    from sweep.spec.strict_yaml import parse_document

    changes: dict[str, object] = {}
    for text in settings or ():
        name, equals, value = text.partition("=")
        if not equals:
            stop(f"--set {text}: must be NAME=VALUE, as in --set n=50")
        given = parse_document(f"{name}: {value}", Path("--set"))
        changes |= given.value
    return state.with_settings(changes) if changes else state


def _is_spec(what: str) -> bool:
    return what.endswith(SPEC_ENDINGS) or Path(what).is_file()


def _state_of(
    what: str, results: Results, *, trust: bool, code: bool, code_from: Path | None
) -> "ViewState":
    """The first point of the first study of a spec, or a study's first stored trial
    with all others of its spec to choose from.
    """
    from sweep.errors import StoreError
    from sweep.own_code.reading import load_specs
    from sweep.web.state import from_study
    from sweep.web.stored import from_stored

    if _is_spec(what):
        return from_study(load_specs(Path(what), code=code, code_from=code_from)[0])
    study = _stored(what, results, trust)
    if study.trials.empty:
        raise StoreError(f"study {what}: no trial is stored yet")
    job = study.job(_of_then(study, study.trials["trial_id"].iloc[0]))
    return from_stored(study, job)


def open_page(url: str) -> None:
    """Open an address in the browser."""
    import webbrowser

    webbrowser.open(url)
