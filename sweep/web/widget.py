"""The live simulator in a notebook.

The page is an anywidget, which reaches the session through the comm of the notebook's
kernel.
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
from sweep.spec import Value
from sweep.tables import StoredStudy, check_output, unfinished
from sweep.text import installing
from sweep.web.filing import KINDS, untold
from sweep.web.live_show import Live
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
    """A live run, or the replay of a stored trial, as a widget of a notebook.

    Steps are taken in a separate thread, which starts with the first hello of a front
    end.

    Parameters
    ----------
    show : Live
        The live run, or the replay.

    Examples
    --------
    >>> view = sweep.view("nguyen2024")
    >>> view.save("flock.png")
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
        """The YAML that launches the shown run, with the sweeps of the user."""
        return str(self._in_turn(lambda: self.show.handle(Spec()))[0]["yaml"])

    def save(self, path: str | Path, *, force: bool = False) -> None:
        """Write the shown frame or run to a file.

        A frame is written as .png or .svg, a run as .gif, .mp4 or .html. A live run
        ends at the shown frame; a stored trial is written from start to end.

        Parameters
        ----------
        path : str or Path
            The file, whose ending names the format.
        force : bool, default False
            Replace a file that exists.

        Raises
        ------
        OutputError
            If the file cannot be written.
        SpecError
            If parameters were changed on the way, because no spec gives this run.

        Examples
        --------
        >>> view.save("flock.gif", force=True)
        """
        place = Path(path)
        check_output(place, [f".{kind}" for kind in KINDS], force=force)
        make = self._in_turn(lambda: self.show.export(place.suffix[1:]))
        content = base64.b64decode(make(untold)["data"])
        with unfinished(place) as file:
            file.write(content)

    def close(self) -> None:
        """Remove the widget from the screen, and end the thread."""
        if self._line:
            self._line.stop()
        super().close()

    def _hear(self, message: object) -> None:
        if self._line is None:
            self._line = _Line(self)
            self._line.start()
            if isinstance(message, dict) and message.get("type") == "hello":
                return  # the line answers the message at the start
        self._line.put(json.dumps(message))

    def _in_turn(self, work: Callable[[], R]) -> R:
        """Return the result of `work`, run with exclusive access to the show."""
        if self._line and self._line.is_alive():
            return self._line.ask(work)
        return work()

    def _repr_mimebundle_(
        self, **kwargs: Any
    ) -> tuple[dict[str, Any], dict[str, Any]] | None:
        """Return the widget, and an image of the frame where there is no front end."""
        bundle = super()._repr_mimebundle_(**kwargs)
        if bundle is None:
            return None
        data, metadata = bundle
        picture = self._in_turn(lambda: self.show.export("png"))
        return data | {"image/png": picture(untold)["data"]}, metadata


class _Line(Thread):
    """A thread that plays a view to all front ends.

    The thread is the line to the front ends, see sweep.web.playing.
    """

    def __init__(self, view: View) -> None:
        super().__init__(name="boidsweep view", daemon=True)
        self.view = view
        self.player = view._player
        self.loop = asyncio.new_event_loop()
        self.texts: asyncio.Queue[str | None] = asyncio.Queue()

    def run(self) -> None:
        """Play until the last message."""
        with asyncio.Runner(loop_factory=lambda: self.loop) as runner:
            runner.run(self.player.play(self))

    def put(self, text: str | None) -> None:
        """Add a message from a front end; None is the last message."""
        self.loop.call_soon_threadsafe(self.texts.put_nowait, text)

    def stop(self) -> None:
        """End the thread after its current work."""
        if self.is_alive():
            self.put(None)
            self.join()

    def ask(self, work: Callable[[], R]) -> R:
        """Return the result of `work`, run in the thread.

        `work` has exclusive access to the show.
        """
        return asyncio.run_coroutine_threadsafe(
            self.player.in_turn(work), self.loop
        ).result()

    async def hear(self) -> str:
        """Return the next message."""
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
    catalogue: Catalogue = BUILT_IN,
) -> View:
    """Return the widget of a live run.

    Parameters
    ----------
    model : str or None
        Name of the model; None for the first model.
    preset : str or None
        Name of the preset; None for the usual preset of the model.
    seed : int
        Seed of the trial, from 0.
    settings : mapping
        Values of parameters by name, in the units of the model. Further parameters have
        the value of the preset.
    catalogue : Catalogue, optional
        Models, metrics and maps by name; by default the built-in ones.

    Raises
    ------
    SpecError
        If a spec would not accept these values.
    """
    try:
        state = begin(model, preset, seed, catalogue)
        return View(Live(state.with_settings(settings) if settings else state))
    except SpecError as error:
        raise SpecError(without_lines(error)) from None


def replay(study: StoredStudy, trial: str) -> View:
    """Return the widget of a stored trial.

    Raises StoreError if the trial cannot be run again.
    """
    return View(Replay(study, trial))
