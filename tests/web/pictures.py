"""The pictures of the README, made by the program itself: `python -m
tests.web.pictures FOLDER`.

page.png is the page as a browser shows it, and flight.gif the run that is on it.
"""

import sys
from pathlib import Path

from sweep.replays.animation import write_animation
from sweep.web.live_show import Live
from tests.web.chromium import Opened, running_browser, running_server

STEPS, EVERY = 240, 3
WIDTH, HEIGHT = 1280, 720


def main(folder: Path) -> None:
    """Write both pictures into `folder`."""
    with running_server() as server, running_browser() as browser:
        context = browser.new_context(
            viewport={"width": WIDTH, "height": HEIGHT}, color_scheme="light"
        )
        opened = Opened(context.new_page(), server)
        opened.send(type="overlays", names=["flocks", "coverage"])
        opened.send(type="step", count=STEPS)
        opened.until(f"boidsweep.view.stage.frame?.step === {STEPS}")
        opened.page.screenshot(path=folder / "page.png")
        show = opened.show
        assert isinstance(show, Live)
        state = show.state.with_settings({"steps": STEPS})
    name, gif = str(state.as_spec()["study"]), folder / "flight.gif"
    write_animation(name, state.job, gif, EVERY, lambda _done, _all: None)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
