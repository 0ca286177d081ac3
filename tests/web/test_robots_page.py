"""What the page shows of boids as robots: who has failed, and where a boid knows others
to be.
"""

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import Page, expect

from sweep.trial.robots import failing_of
from sweep.web.flight import fly
from sweep.web.live_show import Live
from sweep.web.recording import recording_of
from sweep.web.scene import scene_of
from sweep.web.state import ViewState, begin
from tests.web.chromium import Opened
from tests.web.test_page import go_to, live, until_set

Open = Callable[..., Opened]
FAILING = {"failing_share": 0.25, "failing_time": 3.0}
LEGEND = "boidsweep.view.overlays.legends.get('failed')"


CROSSES = """() => {
  const { stage } = boidsweep.view;
  const found = [];
  for (const part of stage.lines().parts) {
    if (!part.includes(`stroke="${stage.colours.ink}"`)) continue;
    const crosses = part.matchAll(/M([^ ]+) ([^L]+)L([^ ]+) ([^M]+)M[^L]+L[^M"]+/g);
    for (const [, x, y, toX, toY] of crosses) {
      found.push([(+x + +toX) / 2, (+y + +toY) / 2, (toX - x) / 2]);
    }
  }
  return found;
}"""
"""The middle of each cross on the screen, and how far its ends are off in x and y."""
ON_SCREEN = """([x, y]) => {
  const at = boidsweep.view.stage.toScreen({ x, y });
  return [at.x, at.y];
}"""
IS_INK = """([x, y, arm]) => {
  const { stage } = boidsweep.view;
  const context = stage.canvas.getContext("2d");
  const at = [Math.floor(x - 0.8 * arm), Math.floor(y - 0.8 * arm)];
  const [r, g, b] = context.getImageData(...at, 1, 1).data;
  const [inkR, inkG, inkB] = stage.colours.ink.match(/[0-9]+/g).map(Number);
  return Math.abs(r - inkR) + Math.abs(g - inkG) + Math.abs(b - inkB) < 150;
}"""


@pytest.fixture(scope="module")
def robots() -> ViewState:
    """A run in which boids err about places, and some fail."""
    settings = {"n": 20, "steps": 10, "map": "empty", "position_noise": 20.0}
    return begin("aziel_chen2025", "as_run").with_settings({**settings, **FAILING})


def test_a_scene_has_those_who_fail_and_when(robots: ViewState) -> None:
    job = robots.job
    fails_at, failing = failing_of(job).fails_at, scene_of(job)["failing"]
    assert failing["how"] == "stop"
    late = np.flatnonzero(fails_at == 3).tolist()
    assert dict(failing["boids"]) == dict.fromkeys(late, 3)
    assert len(failing["boids"]) == 5
    assert scene_of(robots.with_settings({"failing_share": 0}).job)["failing"] is None


@pytest.mark.parametrize("n", [20, 1500])
def test_failed_boids_have_a_cross_and_a_legend(opened: Open, n: int) -> None:
    """Where they are, drawn as triangles or stamped; from the step on in which they
    fail.
    """
    page = opened()
    assert page.ask(f"{LEGEND}.hidden && {LEGEND}.textContent === ''")
    page.send(type="set", name="map", value="empty")
    page.send(type="set", name="n", value=n)
    for name, value in FAILING.items():
        page.send(type="set", name=name, value=value)
        until_set(page, name, value)
    page.until(f"boidsweep.view.stage.frame.n === {n}")
    marked = live(page).scene()["failing"]["boids"]
    assert len(marked) == n // 4
    for step, count in ((2, 0), (3, n // 4), (5, n // 4)):
        bodies = go_to(page, step)
        page.until(f"{LEGEND}.textContent === '✕ {count} of {n // 4} failed: stop'")
        failed = [boid for boid, at in marked if at <= step]
        crosses = page.page.evaluate(CROSSES)
        places = [
            page.page.evaluate(ON_SCREEN, bodies[:2, boid].tolist()) for boid in failed
        ]
        np.testing.assert_allclose(
            np.reshape([cross[:2] for cross in crosses], (-1, 2)),
            np.reshape(places, (-1, 2)),
            atol=0.02,  # two decimals are written
        )
        # The ends of crosses are seen, unless a boid lies on them.
        seen = [page.page.evaluate(IS_INK, cross) for cross in crosses]
        assert sum(seen) >= 0.8 * count
    chosen = marked[0][0]
    page.send(type="select", boid=chosen)
    page.until(f"boidsweep.view.stage.selection?.boid === {chosen}")
    card = page.page.get_by_label("selected boid", exact=True).first
    expect(card).to_contain_text("; failed: stop")
    page.send(type="set", name="failing_share", value=0)
    page.until(f"{LEGEND}.hidden")


def test_rings_are_where_a_boid_knows_its_neighbours_to_be(opened: Open) -> None:
    """Not where they are: all boids err by 20 px about where they are."""
    page = opened()
    for name, value in (("map", "empty"), ("position_noise", 20), ("fov", 360)):
        page.send(type="set", name=name, value=value)
        until_set(page, name, value)
    page.send(type="set", name="perception_range", value=400)
    until_set(page, "perception_range", 400)
    go_to(page, 3)
    page.send(type="select", boid=7)
    page.until("boidsweep.view.stage.selection?.boid === 7")
    known = live(page).selection()["known"]
    assert len(known) > 5
    assert page.ask("boidsweep.view.stage.selection.known") == known
    rings = page.ask(
        "boidsweep.view.stage.lines().parts.filter(part => part.includes('A4 4'))"
    )
    drawn = [
        (float(x) - 4, float(y))
        for ring in rings
        for x, y in re.findall(r"M(-?[\d.]+) (-?[\d.]+)A4 4", ring)
    ]
    places = page.ask(
        "boidsweep.view.stage.selection.known.map(([x, y]) => {"
        " const at = boidsweep.view.stage.toScreen({ x, y });"
        " return [at.x, at.y]; })"
    )
    np.testing.assert_allclose(drawn, places, atol=0.011)  # two decimals are written
    others = live(page).selection()["neighbours"]
    flock = live(page).simulation.flock
    off = np.hypot(*(np.array(known).T - [flock.x[others], flock.y[others]]))
    assert np.median(off) > 5.0


def test_a_recording_marks_the_failed_and_says_what_it_does_not_know(
    page: Page, robots: ViewState, tmp_path
) -> None:
    flight = fly("a/study", robots.job, robots.plots)
    file = recording_of(flight, Live(robots).greeting(), robots.as_text())
    path = tmp_path / file.name
    path.write_bytes(file.content)
    page.goto(path.as_uri())
    legend = page.locator(".legend .swatch").first
    expect(legend).to_have_text("✕ 0 of 5 failed: stop")
    expect(
        page.get_by_text("Measured and received states are not recorded")
    ).to_be_visible()
    page.keyboard.press(".")
    for _ in range(3):
        page.keyboard.press(".")
    expect(legend).to_have_text("✕ 5 of 5 failed: stop")
