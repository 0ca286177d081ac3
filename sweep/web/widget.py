"""The live simulator in a notebook. The page is an anywidget; it reaches its session
through the comm of the notebook's kernel.
"""

import asyncio
import base64
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

from kernels.catalogue import BUILT_IN, Catalogue
from sweep.errors import SpecError
from sweep.spec.settings import Value
from sweep.tables.outputs import check_output, unfinished
from sweep.tables.stored_study import StoredStudy
from sweep.text import installing
from sweep.web.filing import KINDS, untold
from sweep.web.live import Live
from sweep.web.messages import Spec
from sweep.web.page import script, style
from sweep.web.playing import Player, without_lines
from sweep.web.protocol import Reply
from sweep.web.replaying import Replay
from sweep.web.state import begin

try:
    from anywidget import AnyWidget
except ModuleNotFoundError as error:
    raise ImportError(
        f"the widget needs anywidget: {installing('notebook')}"
    ) from error

R = TypeVar("R")


class View(AnyWidget):
    """A live run, or the replay of a stored trial, for a notebook to show.

    `show` is what it shows. Steps are taken in a thread of its own. The thread starts
    with the first hello of a front end.
    """

    _esm = script("widget")
    _css = style()

    def __init__(self, show: Live) -> None:
        super().__init__()
        self.show = show
        self._player = Player(show)
        self._line: _Line | None = None
        self.on_msg(lambda _widget, content, _buffers: self._hear(content))

    @property
    def spec(self) -> str:
        """The YAML that launches what is shown, with the sweeps that the user has
        marked.
        """
        return str(self._in_turn(lambda: self.show.handle(Spec()))[0]["yaml"])

    def save(self, path: str | Path, *, force: bool = False) -> None:
        """Write what is shown to `path`: the frame as .png or .svg, the run as .gif,
        .mp4 or .html.

        Of a live run that is the run up to this frame, of a stored trial the whole run.
        Raises OutputError if the file cannot be written. Raises SpecError if settings
        were changed on the way, because no spec gives such a run.
        """
        place = Path(path)
        check_output(place, [f".{kind}" for kind in KINDS], force=force)
        make = self._in_turn(lambda: self.show.export(place.suffix[1:]))
        content = base64.b64decode(make(untold)["data"])
        with unfinished(place) as file:
            file.write(content)

    def close(self) -> None:
        """Remove it from the screen, and end its thread."""
        if self._line:
            self._line.stop()
        super().close()

    def _hear(self, message: object) -> None:
        if self._line is None:
            self._line = _Line(self)
            self._line.start()
            if isinstance(message, dict) and message.get("type") == "hello":
                return  # the line answers it when it starts
        self._line.put(json.dumps(message))

    def _in_turn(self, work: Callable[[], R]) -> R:
        """What `work` with the show returns. It runs while nobody else works with the
        show.
        """
        if self._line and self._line.is_alive():
            return self._line.ask(work)
        return work()

    def _repr_mimebundle_(
        self, **kwargs: Any
    ) -> tuple[dict[str, Any], dict[str, Any]] | None:
        """The widget, and a picture of the frame for places without a front end."""
        bundle = super()._repr_mimebundle_(**kwargs)
        if bundle is None:
            return None
        data, about = bundle
        picture = self._in_turn(lambda: self.show.export("png"))
        return data | {"image/png": picture(untold)["data"]}, about


class _Line(Thread):
    """A thread that plays a view to its front ends. It is the line to all of them, see
    sweep.web.playing.
    """

    def __init__(self, view: View) -> None:
        super().__init__(name="boidsweep view", daemon=True)
        self.view, self.player = view, view._player
        self.loop = asyncio.new_event_loop()
        self.texts: asyncio.Queue[str | None] = asyncio.Queue()

    def run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self.loop) as runner:
            runner.run(self.player.play(self))

    def put(self, text: str | None) -> None:
        """Add a message from a front end; None is the last one."""
        self.loop.call_soon_threadsafe(self.texts.put_nowait, text)

    def stop(self) -> None:
        """End the thread after its current work."""
        if self.is_alive():
            self.put(None)
            self.join()

    def ask(self, work: Callable[[], R]) -> R:
        """What `work` returns, run in the thread when nobody else works with
        the show.
        """
        return asyncio.run_coroutine_threadsafe(
            self.player.in_turn(work), self.loop
        ).result()

    async def hear(self) -> str:
        """The next message."""
        text = await self.texts.get()
        if text is None:
            raise ConnectionError("the view is closed")
        return text

    async def tell(self, reply: Reply) -> None:
        """Send a message."""
        self.view.send(reply)

    async def show(self, frame: bytes) -> None:
        """Send a frame."""
        self.view.send({"type": "frame"}, buffers=[frame])


def live(
    model: str | None,
    preset: str | None,
    seed: int,
    settings: Mapping[str, Value],
    known: Catalogue = BUILT_IN,
) -> View:
    """The widget of a live run.

        model     the first model for None
        preset    as_run for None
        seed      a whole number from 0
        settings  values by name, in their units; others are those of the preset
        known     what names stand for

    Raises SpecError for what a spec would not accept.
    """
    try:
        state = begin(model, preset, seed, known)
        return View(Live(state.with_settings(settings) if settings else state))
    except SpecError as error:
        raise SpecError(without_lines(error)) from None


def replay(study: StoredStudy, trial: str) -> View:
    """The widget of a stored trial. Raises StoreError if the trial cannot be
    run again.
    """
    return View(Replay(study, trial))
