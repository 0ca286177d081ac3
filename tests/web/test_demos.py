"""The start page: demos are specs that run, show what they promise, and open in the
simulator.
"""

import base64
import json
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import sweep.web.demo as demos
from sweep.spec.study import RecordSpec
from sweep.trial.simulation import Simulation
from sweep.web.demo import DEMOS, FOLDER, moving
from sweep.web.encoding import frame
from sweep.web.flight import KeptFlight, fly
from sweep.web.live_show import Live
from sweep.web.protocol import Reply
from sweep.web.server import PageServer
from tests.cases import slow_but
from tests.web.chromium import PATIENCE, Opened
from tests.web.test_axe import found
from tests.web.test_going_on import copied

Open = Callable[..., Opened]
CARDS = ".demos a"
TOPS = "cards => cards.map((card) => card.getBoundingClientRect().top)"
LOADED = "() => document.querySelector('canvas').width !== 300"
"""The first picture has its frames: a canvas is made 300 wide."""


def test_every_spec_of_the_folder_is_a_demo() -> None:
    assert {path.stem for path in FOLDER.glob("*.yaml")} == set(DEMOS)
    assert len(DEMOS) == 6


@pytest.mark.parametrize("name", slow_but(["flock", "maze"], DEMOS))
def test_a_moving_picture_is_the_run_of_its_spec(name: str) -> None:
    """Its last frame is that of a launch, which takes all steps at once."""
    demo, picture = DEMOS[name], moving(name)
    job = replace(demo.shown().state.job, record=RecordSpec((), trajectories=True))
    steps = demo.first + demo.every * (demo.frames - 1)
    simulation = Simulation(job)
    bodies = simulation.take_frames().bodies
    while simulation.step < steps:
        simulation.advance(steps - simulation.step)
        bodies = simulation.take_frames().bodies
    scene = picture["scene"]
    plain = frame(steps, bodies[-1], (scene["width"], scene["height"]))
    shown = base64.b64decode(picture["frames"][-1])
    assert len(picture["frames"]) == demo.frames
    assert shown[8 : len(plain)] == plain[8:]  # what follows the flags


def test_an_animation_is_simulated_once_for_a_program(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another program, and a damaged file, lead to another simulation."""
    flown = []

    def moving(name: str) -> Reply:
        flown.append(name)
        return {"frames": len(flown)}

    def shown() -> object:
        return json.loads(demos.kept.__wrapped__("maze"))["frames"]

    folder = tmp_path / "cache"
    monkeypatch.setattr(demos, "usual", lambda: folder)
    monkeypatch.setattr(demos, "moving", moving)
    assert [shown(), shown()] == [1, 1]
    monkeypatch.setattr(demos, "kernels_sha", lambda: "another")
    assert [shown(), shown()] == [2, 2]
    (file,) = folder.iterdir()
    file.write_bytes(file.read_bytes()[:40])
    assert [shown(), shown()] == [3, 3]
    assert flown == ["maze"] * 3


@cache
def flown(name: str, steps: int) -> KeptFlight:
    """The first steps of a demo, with the metrics that it plots."""
    state = DEMOS[name].shown().state.with_settings({"steps": steps})
    return fly(name, state.job, state.plots)


def last(name: str, steps: int, metric: str) -> float:
    return float(flown(name, steps).values[metric][-1])


def test_demos_show_what_they_promise() -> None:
    """Each by far, so that none hangs on its seed."""
    assert (
        last("flock", 600, "polarization")
        > 2 * flown("flock", 600).values["polarization"][0]
    )
    assert last("flock", 600, "flock_count") < 30
    covered = last("cafeteria", 600, "coverage_total")
    assert covered > 50 > 1.5 * last("crowd", 600, "coverage_total")
    assert last("maze", 300, "share_arrived") == 100
    x, y = flown("text", 60).bodies[-1][:2]
    assert np.all((x < 0) | (x > 1280) | (y < 0) | (y > 720))
    flocks = flown("thousand", 600).values["flock_count"]
    assert flocks[0] > 2 * flocks[-1] > 10


@pytest.fixture
def started(browser: Browser, server: PageServer) -> Iterator[Callable[..., Page]]:
    """Opens start pages, and sees that none of them has met an error."""
    contexts, complaints = [], []

    def started(**about: object) -> Page:
        context = browser.new_context(**about)  # type: ignore[arg-type]
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(server.start)
        page.locator(CARDS).nth(5).wait_for()
        return page

    yield started
    for context in contexts:
        context.close()
    assert complaints == []


@pytest.mark.parametrize(("scheme", "width"), [("light", 1280), ("dark", 390)])
def test_axe_finds_nothing_on_the_start_page(
    started: Callable[..., Page], scheme: str, width: int
) -> None:
    page = started(color_scheme=scheme, viewport={"width": width, "height": 844})
    assert page.get_by_role("heading", level=1).inner_text() == "boidsweep"
    assert found(page) == []
    for other in (width, 700, 1440, 1920, 2560):
        page.set_viewport_size({"width": other, "height": 844})
        assert not page.evaluate(
            "document.documentElement.scrollWidth"
            " > document.documentElement.clientWidth"
        )
        rows = Counter(page.locator(CARDS).evaluate_all(TOPS))
        assert len({*rows.values()}) == 1, "a row has a hole"


def test_pictures_move_until_they_are_stopped_or_from_the_beginning_not(
    started: Callable[..., Page],
) -> None:
    page = started(reduced_motion="reduce")
    picture = page.locator("canvas").first
    page.wait_for_function(LOADED)
    still = picture.screenshot()
    page.get_by_role("button", name="Play the animations").click()
    page.get_by_role("button", name="Stop the animations").wait_for()
    deadline = time.monotonic() + PATIENCE
    while picture.screenshot() == still:
        assert time.monotonic() < deadline, "it never moved"


def test_a_demo_opens_in_the_simulator_and_is_its_spec(
    server: PageServer, started: Callable[..., Page], opened: Open
) -> None:
    start = started()
    address = start.locator(CARDS).nth(3).get_attribute("href")
    assert address
    page = opened(at=server, locale="en-GB")
    with page.page.expect_event("load"):
        page.page.goto(server.url + address.removeprefix("./"))
    page.until("window.boidsweep?.view.state?.running")
    assert page.ask("boidsweep.view.state.model") == "rustamani2024"
    page.until("boidsweep.view.state.speed === 30")
    page.until("boidsweep.view.stage.frame.step > 2")
    assert page.ask("boidsweep.view.stage.overlays.has('trails')")
    assert copied(page) == DEMOS["maze"].text
    first = page.ask("boidsweep.view.page")
    page.page.reload()
    page.until("window.boidsweep?.view.stage.frame?.step > 2")
    assert page.ask("boidsweep.view.page") == first
    other = start.locator(CARDS).first.get_attribute("href")
    assert other
    with page.page.expect_event("load"):
        page.ask(f"location.hash = '{other.removeprefix('./')}'")
    page.until("window.boidsweep?.view.state?.model === 'nanobot'")
    assert page.ask("boidsweep.view.page") != first
    show = page.show
    assert isinstance(show, Live)
    assert show.state.as_text() == DEMOS["flock"].text


def test_the_demo_of_two_presets_opens_both_side_by_side(
    server: PageServer, started: Callable[..., Page], opened: Open
) -> None:
    start = started(reduced_motion="reduce")
    address = start.locator(CARDS).nth(4).get_attribute("href")
    assert address
    page = opened(at=server, locale="en-GB")
    with page.page.expect_event("load"):
        page.page.goto(server.url + address.removeprefix("./"))
    page.until("window.boidsweep?.second?.stage.frame?.step > 0")
    presets = page.ask(
        "[boidsweep.view, boidsweep.second].map(({ state }) => state.preset)"
    )
    assert presets == ["as_written", "as_run"]
    assert page.ask("boidsweep.second.stage.overlays.has('trails')")


def test_only_who_knows_the_token_sees_demos(server: PageServer) -> None:
    elsewhere = server.url.replace(server.token, "x" * len(server.token))
    wrong = f"{elsewhere}demos", f"{elsewhere}demos/maze", f"{server.url}demos/no"
    for address in wrong:
        with pytest.raises(HTTPError, match="404"):
            urlopen(address)
    with urlopen(f"{server.url}demos") as answer:
        assert "default-src 'none'" in answer.headers["Content-Security-Policy"]
