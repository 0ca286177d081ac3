"""Everything that the server of the explorer offers.

The server has the page, the answers to questions of the page, and the stored trials
that the page plays.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlencode

from sweep.explorer import asking
from sweep.explorer.asking import AskComparison, AskRefine, fields_by_key, read
from sweep.explorer.changing import refine
from sweep.explorer.compared import comparison
from sweep.explorer.drawn import figure, file
from sweep.explorer.mentioned import published_at
from sweep.explorer.points import points
from sweep.explorer.scored import picture, scorecard
from sweep.explorer.searched import search
from sweep.explorer.states import state, studies
from sweep.explorer.trials import spec, trials
from sweep.explorer.watching import Watched
from sweep.store import Location, keep, local_folder
from sweep.tables import StoredStudy
from sweep.web import Launcher, Live, PageSite, Pairs, Replay, RunShow, Show, begin

if TYPE_CHECKING:
    from sweep.web import PageServer

HOME = "show.html"
QUESTIONS: dict[str, tuple[type[Any], Callable[[Watched, Any], dict[str, Any]]]] = {
    "studies": (asking.AskStudies, studies),
    "state": (asking.AskState, state),
    "points": (asking.AskPoints, points),
    "trials": (asking.AskTrials, trials),
    "spec": (asking.AskSpec, spec),
    "figure": (asking.AskFigure, figure),
    "file": (asking.AskFile, file),
    "published": (asking.AskPublished, published_at),
    "compare": (asking.AskComparison, comparison),
    "search": (asking.AskSearch, search),
    "scorecard": (asking.AskScorecard, scorecard),
    "picture": (asking.AskPicture, picture),
}


def explorer(
    results: Location,
    first: str | AskComparison | None,
    port: int = 0,
    *,
    trust: bool = False,
    launcher: Launcher | None = None,
) -> tuple["PageServer", str]:
    """Return the server of the explorer, and the address of the first view.

    Parameters
    ----------
    results : Location
        Folder or object store of the stored studies.
    first : str, AskComparison or None
        A study, two sides to compare, or None for the list of all studies.
    port : int, default 0
        Port of the server; 0 for any free port.
    trust : bool, default False
        Allow custom code of a study that somebody else ran.
    launcher : Launcher, optional
        Launches the spec of the user from the page. The study need not be stored yet.

    Raises
    ------
    StoreError
        If the study is not stored, or if `results` is an object store and `first` is
        None, because an object store has no list of studies.
    ChoiceError
        If the two sides cannot be compared.
    """
    # Here, as notebooks do without a server.
    from sweep.web import PageServer

    keep()
    watched = Watched(results, trust=trust)
    begin = ""
    if isinstance(first, AskComparison):
        comparison(watched, first)
        begin = f"#{address(first)}"
    elif first:
        if not (launcher and launcher.study == first):
            watched.counted(first)
        begin = f"#study={quote(first)}"
    else:
        local_folder(results, "to begin with the list of studies needs")
    server = PageServer(_simulator, port, site_of(watched, launcher))
    return server, server.url + begin


def address(question: AskComparison) -> str:
    """Return the part of an address for a question, without default values."""
    choices = [
        (key, _spelled(value))
        for key, member in fields_by_key(type(question)).items()
        if (value := getattr(question, member.name)) != member.default
    ]
    return urlencode(choices, quote_via=quote)


def _spelled(value: object) -> str:
    if isinstance(value, tuple):
        return " ".join(map(str, value))
    return "yes" if value is True else str(value)


def site_of(watched: Watched, launcher: Launcher | None = None) -> PageSite:
    """Return everything that a server offers of stored studies."""
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


def _replayed(watched: Watched, study: str, trial: str) -> RunShow:
    return Replay(StoredStudy(study, watched.results, trust=watched.trust), trial)


def _simulator() -> Show:
    """Return the view of the simulator for a page that names no trial."""
    return Live(begin())
