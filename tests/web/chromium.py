"""Debian's chromium, driven by playwright, on a page of a server in a thread of this
process.
"""

import shutil
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from sweep.web.live_show import Live
from sweep.web.server import PageServer
from sweep.web.show import Show
from sweep.web.state import begin
from tests.patience import PATIENCE

BEGIN_ANEW = """() => {
  const { view } = boidsweep;
  document.querySelectorAll("dialog[open]").forEach((one) => one.close());
  const usual = ["schedule", "parameters"];
  document.querySelectorAll("details").forEach((one) => {
    one.open = usual.includes(one.dataset.group);
  });
  document.activeElement.blur();
  view.hand.drag = null;
  view.hand.use("select");
  view.hand.mark(null);
  view.fit("world");
  view.overlays.show([]);
  view.stage.overlays.clear();
  view.stage.edited = null;
  view.stage.forget();
  view.groups.accept();
  view.toasts.element.replaceChildren();
  view.presentation.end();
  view.root.classList.remove("without-settings", "without-watch");
  view.panels.choose("settings");
  for (const name of Object.keys(view.state.sweeps)) {
    view.send({ type: "sweep", name, off: true });
  }
  view.send({ type: "pause" });
  view.send({ type: "overlays", names: [] });
  view.send({ type: "select", boid: null });
  view.send({ type: "speed", steps_per_second: 60 });
  view.send({ type: "model", model: "aziel_chen2025", preset: "as_run" });
  view.send({ type: "set", name: "seed", value: 1 });
}"""


@contextmanager
def running_browser() -> Iterator[Browser]:
    """A browser without a screen. Raises RuntimeError with the way to install one where
    there is none.
    """
    path = shutil.which("chromium")
    if path is None:
        raise RuntimeError(
            "chromium is not installed: apt-get update && apt-get install -y chromium,"
            " as root"
        )
    expect.set_options(timeout=1000 * PATIENCE)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=path, args=["--no-sandbox", "--disable-gpu"]
        )
        with pytest.MonkeyPatch.context() as patch:
            for name in ("new_context", "new_page"):
                patch.setattr(browser, name, patient(getattr(browser, name)))
            yield browser
        browser.close()


def patient(make: Callable[..., Any]) -> Callable[..., Any]:
    """Return `make`, which makes a page or a context, with our patience for what it
    makes.
    """

    def made(**options: Any) -> Any:
        new = make(**options)
        new.set_default_timeout(1000 * PATIENCE)
        return new

    return made


def in_the_cafeteria() -> Live:
    """The show of a page that says nothing else."""
    return Live(begin("aziel_chen2025", "as_run"))


@contextmanager
def in_a_thread(server: PageServer) -> Iterator[PageServer]:
    """Run `server` in a thread."""
    thread = threading.Thread(target=server.run)
    thread.start()
    yield server
    server.stop()
    thread.join(PATIENCE)
    assert not thread.is_alive()


@contextmanager
def running_server(show: Callable[[], Show] = in_the_cafeteria) -> Iterator[PageServer]:
    """A server that makes a show for every page."""
    with in_a_thread(PageServer(show)) as server:
        yield server


class Opened:
    """A page that shows a session: what the browser has, and the session itself, which
    lies in this process.
    """

    def __init__(self, page: Page, server: PageServer) -> None:
        self.page = page
        self.server = server
        self.complaints: list[str] = []
        page.on(
            "console",
            lambda message: (
                self.complaints.append(message.text)
                if message.type == "error"
                else None
            ),
        )
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.goto(server.url)
        self.until("Boolean(window.boidsweep?.view.stage.frame)")

    def begin_anew(self) -> "Opened":
        """The page as if it were opened now, which would
        take a second of a processor.
        """
        self.complaints.clear()
        self.page.set_viewport_size({"width": 1280, "height": 720})
        self.page.emulate_media(color_scheme="light")
        self.page.mouse.move(0, 0)
        self.page.evaluate(BEGIN_ANEW)
        self.until("!boidsweep.view.asked && boidsweep.view.stage.frame.step === 0")
        self.ask("boidsweep.view.status.say('')")
        return self

    def rest(self) -> None:
        """Let nothing fly until somebody begins anew: it would take half a processor
        from all tests that come between.
        """
        self.send(type="pause")

    @property
    def show(self) -> Show:
        """The session behind the page."""
        return self.server.rooms.players[str(self.ask("boidsweep.view.page"))].show

    def ask(self, expression: str) -> Any:
        """The value of a JavaScript expression in the page."""
        return self.page.evaluate(expression)

    def until(self, expression: str) -> Any:
        """The value of a JavaScript expression once it is true. Raises TimeoutError
        after PATIENCE seconds.

        playwright's own waiting would need eval, which the page forbids.
        """
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            value = self.ask(expression)
            if value:
                return value
            self.page.wait_for_timeout(30)
        raise TimeoutError(f"never true: {expression}; {self.complaints}")

    def send(self, **message: Any) -> None:
        """Let the page send a message."""
        self.page.evaluate("message => boidsweep.view.send(message)", message)

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Where a place of the world is on the page."""
        found = self.page.evaluate(
            """([x, y]) => {
              const { stage } = boidsweep.view;
              const at = stage.toScreen({ x, y });
              const box = stage.canvas.getBoundingClientRect();
              return [at.x + box.left, at.y + box.top];
            }""",
            [x, y],
        )
        return found[0], found[1]

    def drag(self, begin: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag the mouse between two places of the world."""
        start, stop = self.place(*begin), self.place(*end)
        self.page.mouse.move(*start)
        self.page.mouse.down()
        self.page.mouse.move((start[0] + stop[0]) / 2, (start[1] + stop[1]) / 2)
        self.page.mouse.move(*stop)
        self.page.mouse.up()
