"""The command that opens the live simulator."""

import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.cli.app import Results, app, stop

if TYPE_CHECKING:
    from sweep.web.show import Show
    from sweep.web.state import ViewState

EXTRA = 'the live simulator needs more packages: pip install "boidsweep[view]"'
SPECS = (".yaml", ".yml")


@app.command()
def view(
    what: Annotated[
        str | None,
        typer.Argument(
            metavar="[SPEC | STUDY]",
            help="A spec or a study, of which the first point is shown.",
        ),
    ] = None,
    trial: Annotated[
        str | None,
        typer.Argument(
            metavar="[TRIAL]", help="A stored trial of the study to replay."
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(help="A model; by default the first of `sweep models`."),
    ] = None,
    preset: Annotated[
        str | None, typer.Option(help="A preset of it; as_run by default.")
    ] = None,
    map_name: Annotated[
        str | None, typer.Option("--map", help="A map; that of the preset by default.")
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
) -> None:
    """See the swarm in the browser: a model, a spec or study from its first point, or a
    stored trial again.

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
    try:
        from sweep.web.server import PageServer
    except ModuleNotFoundError as error:
        stop(f"{EXTRA} ({error.name} is missing)")
    begin = (
        _replayed(what, trial, results)
        if what and trial
        else _live(_state(what, model, preset, map_name, results))
    )
    server = PageServer(_first_at_once(begin), port)
    print(server.url, flush=True)
    print("Ctrl-C ends it", file=sys.stderr)
    if not no_open:
        _open(server.url)
    with suppress(KeyboardInterrupt):
        server.run()


def _first_at_once(begin: "Callable[[], Show]") -> "Callable[[], Show]":
    """A function that makes a show for each page. The first show is made now, so that a
    mistake is reported before the page opens.
    """
    made = [begin()]
    return lambda: made.pop() if made else begin()


def _replayed(study: str, trial: str, results: Results) -> "Callable[[], Show]":
    from sweep.tables.stored_study import StoredStudy
    from sweep.web.replaying import Replay

    stored = StoredStudy(study, results)
    return lambda: Replay(stored, trial)


def _live(state: "ViewState") -> "Callable[[], Show]":
    from sweep.web.live import Live

    return lambda: Live(state)


def _state(
    what: str | None,
    model: str | None,
    preset: str | None,
    map_name: str | None,
    results: Results,
) -> "ViewState":
    """The state with which a live run begins."""
    from sweep.own_code.reading import load_spec
    from sweep.web.state import begin, from_study

    if what is None:
        state = begin(model, preset)
        return state.with_settings({"map": map_name}) if map_name else state
    if _is_spec(what):
        return from_study(load_spec(Path(what)))
    return _stored(what, results)


def _is_spec(what: str) -> bool:
    return what.endswith(SPECS) or Path(what).is_file()


def _stored(name: str, results: Results) -> "ViewState":
    """The first stored trial of a study."""
    from sweep.errors import StoreError
    from sweep.tables.stored_study import StoredStudy
    from sweep.web.state import from_job

    study = StoredStudy(name, results)
    if study.trials.empty:
        raise StoreError(f"study {name}: no trial is stored yet")
    return from_job(study.job(study.trial(study.trials["trial_id"].iloc[0])))


def _open(url: str) -> None:
    import webbrowser

    webbrowser.open(url)
