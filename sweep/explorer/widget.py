"""The explorer in a notebook: the page in a frame.

Questions and played trials go through the comm of the kernel of the notebook. The
widget needs no server and no port, so the widget works wherever the kernel runs.

The page sends these messages, each with an `id`, and receives `heard id` at once:

- `ask question query`: query is a list of names with values; the reply is
  `answer id answer`, or `refusal id why`
- `open line`: asks for a run to play; the page chooses the name of the line
- `say line text`: a message of the page of the run, see sweep.web.protocol
- `close line`: the page of the run is gone

For a run the page receives `told line message`, `frame line` with bytes, and in the end
`over line why`.
"""

import asyncio
import base64
import io
import logging
from collections.abc import Callable, Coroutine
from contextlib import suppress
from threading import Thread
from typing import Any
from urllib.parse import quote

import traitlets
from matplotlib import style as styles

from sweep.errors import ChoiceError, SpecError, UserError
from sweep.explorer.asking import AskFigure
from sweep.explorer.drawn import drawn
from sweep.explorer.frame import framed
from sweep.explorer.site import site_of
from sweep.explorer.watching import Watched
from sweep.figures import STYLE, about_study
from sweep.store import Location, local_folder
from sweep.tables import StoredStudy
from sweep.text import installing
from sweep.web import REFUSED, PageSite, Pairs, Reply, Rooms, Show, script

try:
    from anywidget import AnyWidget
except ModuleNotFoundError as error:
    raise ImportError(
        f"the widget needs anywidget: {installing('notebook')}"
    ) from error

MOST_LINES = 64
"""Maximum number of open runs on the pages of a widget."""
CLOSED = {REFUSED: "The kernel has no run for this page."}
ELSEWHERE = "This run continues in another view."
log = logging.getLogger("sweep")


class Explored(AnyWidget):
    """A widget that shows stored studies in a notebook.

    A thread answers the questions. The thread starts with the first question.
    """

    _esm = script("explored")
    page = traitlets.Unicode().tag(sync=True)
    begin = traitlets.Unicode().tag(sync=True)

    def __init__(self, watched: Watched, study: str | None) -> None:
        begin = f"#study={quote(study)}" if study else ""
        super().__init__(page=framed(), begin=begin)
        self.watched = watched
        self.study = study
        self._desk: _Desk | None = None
        self.on_msg(lambda _widget, content, _buffers: self._hear(content))

    def close(self) -> None:
        """Remove the widget from the screen, and end the thread."""
        if self._desk:
            self._desk.stop()
        super().close()

    def _hear(self, message: object) -> None:
        """Pass on a message of a page.

        A message without an id does not come from a page of the explorer.
        """
        if not isinstance(message, dict) or not isinstance(message.get("id"), str):
            return
        self.send({"type": "heard", "id": message["id"]})
        if self._desk is None:
            self._desk = _Desk(site_of(self.watched), self.send)
            self._desk.start()
        self._desk.put(message)

    def _repr_mimebundle_(
        self, **kwargs: Any
    ) -> tuple[dict[str, Any], dict[str, Any]] | None:
        """Return the widget, with the first figure of the study.

        The figure is for places without a front end.
        """
        bundle = super()._repr_mimebundle_(**kwargs)
        picture = self._picture() if self.study else b""
        if bundle is None or not picture:
            return bundle
        data, metadata = bundle
        return data | {"image/png": base64.b64encode(picture).decode()}, metadata

    def _picture(self) -> bytes:
        """Return the first figure of the page as PNG; empty if no figure suits."""
        assert self.study
        study = self.watched.counted(self.study)[1]
        file = io.BytesIO()
        try:
            question = AskFigure(self.study, metric=tuple(study.metrics[:1]))
            figure = drawn(self.watched, question)
            with styles.context(STYLE):
                figure.savefig(file, format="png", metadata=about_study(study))
        except UserError:
            return b""
        return file.getvalue()


class _KernelLine:
    """A line to a page of a run, see `sweep.web.outbox.Line`."""

    def __init__(self, name: str, send: Callable[..., None]) -> None:
        self.name = name
        self.send = send
        self.texts: asyncio.Queue[str | None] = asyncio.Queue()

    async def hear(self) -> str:
        text = await self.texts.get()
        if text is None:
            raise ConnectionError("the page is gone")
        return text

    async def tell(self, reply: Reply) -> None:
        self.send({"type": "told", "line": self.name, "message": reply})

    async def show(self, frame: bytes) -> None:
        self.send({"type": "frame", "line": self.name}, buffers=[frame])


class _Desk(Thread):
    """A thread that answers the pages of a widget, and plays trials to the pages."""

    def __init__(self, site: PageSite, send: Callable[..., None]) -> None:
        super().__init__(name="boidsweep explorer", daemon=True)
        self.site = site
        self.send = send
        self.loop = asyncio.new_event_loop()
        self.messages: asyncio.Queue[dict[str, Any] | None] = asyncio.Queue()
        self.rooms = Rooms(_no_simulator, site.stored)
        self.lines: dict[str, _KernelLine] = {}

    def put(self, message: dict[str, Any] | None) -> None:
        """Add a message of a page, with an id; None is the last message."""
        self.loop.call_soon_threadsafe(self.messages.put_nowait, message)

    def stop(self) -> None:
        """End the thread after its current work."""
        if self.is_alive():
            self.put(None)
            self.join()

    def run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self.loop) as runner:
            runner.run(self._serve())

    async def _serve(self) -> None:
        tasks = set[asyncio.Task[None]]()
        while (message := await self.messages.get()) is not None:
            if work := self._work(message):
                task = asyncio.create_task(work)
                tasks.add(task)
                task.add_done_callback(tasks.discard)
        for task in tasks:
            task.cancel()

    def _work(self, message: dict[str, Any]) -> Coroutine[Any, Any, None] | None:
        """Return the work for a message, if the work takes long."""
        match message:
            case {
                "type": "ask",
                "id": message_id,
                "question": str(name),
                "query": query,
            } if _is_query(query):
                return self._answer(
                    message_id, name, [(pair[0], pair[1]) for pair in query]
                )
            case {"type": "open", "line": str(name)} if len(self.lines) < MOST_LINES:
                self.lines[name] = _KernelLine(name, self.send)
                return self._play(self.lines[name])
            case {"type": "say", "line": str(name), "text": str(text)}:
                self._tell_line(name, text)
            case {"type": "close", "line": str(name)}:
                self._tell_line(name, None)
            case _:
                self._refuse(message["id"], "the message is not valid")
        return None

    def _tell_line(self, name: str, text: str | None) -> None:
        if line := self.lines.get(name):
            line.texts.put_nowait(text)

    def _refuse(self, message_id: str, why: str) -> None:
        self.send({"type": "refusal", "id": message_id, "why": why})

    async def _answer(self, message_id: str, name: str, pairs: Pairs) -> None:
        answer = self.site.questions.get(name)
        try:
            if answer is None:
                raise ChoiceError("the question is unknown in a notebook", name)
            reply = await asyncio.to_thread(answer, pairs)
            self.send({"type": "answer", "id": message_id, "answer": reply})
        except UserError as error:
            self._refuse(message_id, str(error))
        except Exception as error:
            log.error("the explorer failed", exc_info=error)
            self._refuse(message_id, f"the explorer failed: {type(error).__name__}")

    async def _play(self, line: _KernelLine) -> None:
        try:
            with suppress(ConnectionError):
                code = await self.rooms.serve(line)
                why = CLOSED.get(code, ELSEWHERE)
                self.send({"type": "over", "line": line.name, "why": why})
        finally:
            if self.lines.get(line.name) is line:
                del self.lines[line.name]


def _is_query(query: object) -> bool:
    return isinstance(query, list) and all(
        isinstance(pair, list) and [type(word) for word in pair] == [str, str]
        for pair in query
    )


def _no_simulator() -> Show:
    raise SpecError("this page plays only stored trials; sweep.view has the simulator")


def explored(results: Location, study: str | None, *, trust: bool) -> Explored:
    """Return the widget of a folder of results.

    Parameters
    ----------
    results : Location
        Folder or object store of the stored studies.
    study : str or None
        The study of the first view; None for the list of all studies.
    trust : bool
        Allow custom code of a study that somebody else ran.

    Raises
    ------
    StoreError
        If the study is not stored, or if `results` is an object store and `study` is
        None, because an object store has no list of studies.
    """
    watched = Watched(results, trust=trust)
    if study is None:
        local_folder(results, "to begin with the list of studies needs")
    else:
        watched.counted(study)
    return Explored(watched, study)


def explored_study(study: StoredStudy) -> Explored:
    """Return the widget of a loaded study.

    Raises ChoiceError if the study has only a selection of trials, because the page
    selects trials.
    """
    if study.restricted:
        raise ChoiceError(
            "the explorer shows only whole studies; write conditions into the field"
            " where of the explorer",
            study.name,
        )
    return explored(study.store.results, study.name, trust=study.trust)
