"""Panels that hide, tabs where it is narrow, the presentation, and boids that have left
the world.
"""

from collections.abc import Callable

import numpy as np

from tests.web.chromium import Opened
from tests.web.test_access import picture, troubles

Open = Callable[..., Opened]
STAGE = "boidsweep.view.stage"


def test_panels_hide_and_give_their_room_to_the_picture(opened: Open) -> None:
    page = opened()
    width, _ = picture(page)
    page.page.keyboard.press("s")
    assert picture(page)[0] == width + 332
    page.page.get_by_role("button", name="Overlays and metrics (M)").click()
    assert picture(page)[0] == 1280
    assert not troubles(page, "overflowing", "nameless")
    page.page.set_viewport_size({"width": 900, "height": 720})
    assert picture(page)[0] == 900
    page.page.keyboard.press("m")
    page.page.keyboard.press("s")
    page.page.set_viewport_size({"width": 1280, "height": 720})
    assert picture(page)[0] == width


def test_a_narrow_page_has_one_panel_at_a_time(opened: Open) -> None:
    page = opened()
    page.page.set_viewport_size({"width": 390, "height": 844})
    settings = page.page.get_by_role("complementary", name="parameters")
    watch = page.page.get_by_role("complementary", name="overlays and metrics")
    assert settings.is_visible()
    assert not watch.is_visible()
    page.page.get_by_role("button", name="Overlays and metrics").click()
    assert watch.is_visible()
    assert not settings.is_visible()
    page.page.locator(".layout").evaluate("one => one.scrollTo(0, 400)")
    box = page.page.locator(".picture").bounding_box()
    assert box
    assert box["y"] == 0
    page.page.get_by_role("button", name="Parameters").click()
    page.page.set_viewport_size({"width": 1280, "height": 720})
    assert watch.is_visible()
    assert settings.is_visible()


SHOWN = """[...document.querySelectorAll('.field, .plot, aside, .top, .picture, .run')]
  .filter((one) => one.checkVisibility()).map((one) => one.className.split(' ')[0])"""


ORDER = """[...document.querySelectorAll('.field label')]
  .map((one) => one.textContent)"""


def test_a_presentation_has_the_picture_one_slider_and_one_plot(opened: Open) -> None:
    page = opened()
    before = page.ask(ORDER)
    page.page.keyboard.press("p")
    page.until("document.fullscreenElement")
    assert sorted(page.ask(SHOWN)) == ["field", "picture", "plot", "run"]
    weight = "document.querySelector('.stand label').textContent"
    first = page.ask(weight)
    page.page.keyboard.press("2")
    assert page.ask(weight) != first
    page.page.locator(".stand input[type=range]").press("ArrowRight")
    page.until("boidsweep.view.state.changed.length === 1")
    for width, height in ((1920, 1080), (390, 844), (320, 256)):
        page.page.set_viewport_size({"width": width, "height": height})
        assert not troubles(page, "overflowing", "nameless", "faint"), (width, height)
    page.page.keyboard.press("Escape")
    page.until("!document.fullscreenElement")
    assert page.ask(ORDER) == before
    assert "aside" not in page.ask(SHOWN)
    assert page.ask("document.querySelectorAll('.stand > *').length") == 0


def test_boids_that_have_left_are_counted_and_followed(opened: Open) -> None:
    page = opened()
    note = page.page.get_by_role("button", name="outside: follow")
    assert not note.is_visible()
    page.send(type="model", model="nguyen2024", preset="as_written")
    page.until("boidsweep.view.state.model === 'nguyen2024'")
    page.send(type="step", count=100)
    page.until("boidsweep.view.stage.frame.step === 100")
    x, y = page.show.bodies[:2]  # type: ignore[attr-defined]
    far = int(np.sum((x < -1280) | (x > 2560) | (y < -740) | (y > 1480)))
    assert 0 < far <= 200
    words = f"{far} of them too far to be shown, drawn at the edge"
    page.page.get_by_text(f"200 boids outside: follow; {words}").click()
    assert page.ask("boidsweep.view.stage.fit") == "boids"
    page.send(type="reset")
    note.wait_for(state="hidden")


def test_a_sample_of_many_boids_has_arrows_in_colours_of_their_own(
    opened: Open,
) -> None:
    page = opened()
    hues, rules = map(page.ask, (f"{STAGE}.hues", f"{STAGE}.rules"))
    assert not {*hues} & {*rules}
    page.send(type="set", name="n", value=1200)
    page.send(type="overlays", names=["accelerations", "flocks"])
    page.page.get_by_text("; of one boid in 3").wait_for()
    page.send(type="select", boid=5)
    page.page.get_by_text("; of one boid in 3").wait_for(state="detached")


def test_a_setting_that_follows_from_the_map_is_no_axis(opened: Open) -> None:
    page = opened()
    page.ask("document.querySelectorAll('details').forEach((one) => one.open = true)")
    row = page.page.locator(".field[data-name=width]")
    sweep = row.get_by_role("button", name="Sweep width in the copied spec")
    row.get_by_text("follows from map").wait_for()
    assert not sweep.is_visible()
    page.send(type="set", name="map", value="empty")
    sweep.wait_for()
    assert row.get_by_text("follows from").count() == 0


def test_titles_edits_and_a_low_page_show_all_of_themselves(opened: Open) -> None:
    """Toggles are in the order of the panels, no word of an edit is cut, the ring of a
    focus stays within its title, and the world is large where the page is low.
    """
    page = opened()
    names = ["Overlays and metrics (M)", "Parameters (S)"]
    toggles = [page.page.get_by_role("button", name=name) for name in names]
    left, right = (one.bounding_box() for one in toggles)
    assert left
    assert right
    assert left["x"] < right["x"]
    page.send(type="set", name="cohesion_weight", value=0.123456)
    undo = page.page.get_by_role("button", name="Undo cohesion weight")
    undo.wait_for()
    assert undo.evaluate(
        "({ lastElementChild: { scrollWidth, clientWidth } }) =>"
        " scrollWidth <= clientWidth"
    )
    title = page.page.locator(".plot h3 button").first
    title.evaluate("(one) => one.focus({ focusVisible: true })")
    assert title.evaluate("(one) => getComputedStyle(one).outlineOffset") == "-2px"
    page.page.set_viewport_size({"width": 640, "height": 360})
    page.until(f"{STAGE}.height > 250")
    _, height = page.ask(
        f"{STAGE}.box(0, 0, {STAGE}.world.width, {STAGE}.world.height).slice(2)"
    )
    assert height >= 200
