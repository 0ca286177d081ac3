"""What the server of the explorer has: the page, the answers to its questions, and the
stored trials that it plays.
"""

from collections.abc import Callable
from functools import partial
from typing import Any
from urllib.parse import quote

from sweep.explorer import asking
from sweep.explorer.asking import AskRefine, read
from sweep.explorer.changing import refine
from sweep.explorer.drawn import figure
from sweep.explorer.points import points
from sweep.explorer.states import state, studies
from sweep.explorer.trials import spec, trials
from sweep.explorer.watching import Watched
from sweep.store.locations import Location
from sweep.tables.stored_study import StoredStudy
from sweep.web.launching import Launcher
from sweep.web.live import Live
from sweep.web.replaying import Replay
from sweep.web.server import PageServer, PageSite, Pairs
from sweep.web.show import Show
from sweep.web.state import begin

HOME = "show.html"
QUESTIONS: dict[str, tuple[type[Any], Callable[[Watched, Any], dict[str, Any]]]] = {
    "studies": (asking.AskStudies, studies),
    "state": (asking.AskState, state),
    "points": (asking.AskPoints, points),
    "trials": (asking.AskTrials, trials),
    "spec": (asking.AskSpec, spec),
    "figure": (asking.AskFigure, figure),
}


def explorer(
    results: Location,
    study: str | None,
    port: int = 0,
    *,
    trust: bool = False,
    launcher: Launcher | None = None,
) -> tuple[PageServer, str]:
    """The server of the explorer of a folder of results, and the address that begins
    with a study, or with the list of all. Raises StoreError where there is none, but
    for the study that the page launches.
    """
    watched = Watched(results, trust=trust)
    if study and not (launcher and launcher.study == study):
        watched.narrow(study)
    server = PageServer(_simulator, port, site_of(watched, launcher))
    return server, server.url + (f"#study={quote(study)}" if study else "")


def site_of(watched: Watched, launcher: Launcher | None = None) -> PageSite:
    """What a server has of these studies."""
    answers = {name: partial(_answer, watched, name) for name in QUESTIONS}
    answers["refine"] = partial(_refined, watched, launcher)
    return PageSite(HOME, answers, partial(_replayed, watched), launcher)


def _refined(
    watched: Watched, launcher: Launcher | None, pairs: Pairs
) -> dict[str, Any]:
    return refine(watched, launcher, read(AskRefine, pairs))


def _answer(watched: Watched, name: str, pairs: Pairs) -> dict[str, Any]:
    kind, answer = QUESTIONS[name]
    return answer(watched, read(kind, pairs))


def _replayed(watched: Watched, study: str, trial: str) -> Show:
    return Replay(StoredStudy(study, watched.results, trust=watched.trust), trial)


def _simulator() -> Show:
    """What the page of the simulator shows on this server if it names no trial."""
    return Live(begin())
