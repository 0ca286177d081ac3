"""The pictures of the README and of the guide, made by the program itself: `python -m
tests.web.pictures FOLDER`.

page.png is the page as a browser shows it, and flight.gif the run that is on it.
swarms.png is the living phase diagram of the study in the guide.
"""

import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from PIL import Image
from playwright.sync_api import Browser

from docs.building.blocks import blocks
from docs.building.documents import read
from sweep.replays.animation import write_animation
from sweep.web.live_show import Live
from tests.explorer.supplements import written
from tests.studies import launched
from tests.web.chromium import Opened, running_browser, running_server

STEPS, EVERY = 240, 3
WIDTH, HEIGHT = 1280, 720
GUIDE = "docs/guide/interactive-figures.md"
LATER = 160
"""Frames after which the swarms of the diagram are in order."""


def main(folder: Path) -> None:
    """Write all pictures into `folder`."""
    with running_browser() as browser:
        write_simulator(folder, browser)
        write_swarms(folder, browser)


def write_simulator(folder: Path, browser: Browser) -> None:
    """Write page.png and flight.gif into `folder`."""
    with running_server() as server:
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


def write_swarms(folder: Path, browser: Browser) -> None:
    """Write swarms.png into `folder`: the study of the guide runs in this process."""
    (spec,) = (block.text for block in blocks(GUIDE, read(GUIDE)) if block.file)
    page = browser.new_page(
        viewport={"width": WIDTH, "height": HEIGHT},
        device_scale_factor=2,
        color_scheme="light",
        reduced_motion="reduce",
    )
    with TemporaryDirectory() as results:
        study = launched(spec, Path(results))
        path = written(study, Path(results) / "order.html")
        page.goto(f"{path.as_uri()}?embed#swarms=on")
    page.locator(".swarms").wait_for()
    page.evaluate("place => supplement.living.turn(place)", LATER)
    page.evaluate("() => new Promise(requestAnimationFrame)")
    figure = page.locator(".chart").bounding_box()
    plot = page.locator(".plotted").bounding_box()
    assert figure
    assert plot
    clip = {**figure, "height": plot["y"] + plot["height"] - figure["y"]}
    with Image.open(BytesIO(page.screenshot(clip=clip))) as image:
        # A palette of 256 colours: the file is a third as large.
        image.convert("RGB").quantize().save(folder / "swarms.png", optimize=True)
    page.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
