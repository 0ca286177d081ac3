"""The page for everyone: names, contrast, targets, keyboard, and room, on a screen and
on a tablet, light and dark.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.web.chromium import Opened

Open = Callable[..., Opened]

CHECKS = (Path(__file__).parent / "access.js").read_text().partition("export ")[2]
"""The function that the script exports, as playwright takes it."""


def troubles(page: Opened, *checks: str) -> dict[str, list[str]]:
    """What these checks of access.js find."""
    found: dict[str, list[str]] = page.page.evaluate(CHECKS, checks)
    return found


def everything_open(page: Opened) -> None:
    """All that the page can show at once: a changed and a swept setting, a boid, an
    obstacle, overlays, a message.
    """
    page.send(type="sweep", name="fov", low=60, high=360, points=4)
    page.send(type="overlays", names=["flocks", "coverage", "accelerations"])
    page.send(type="select", boid=3)
    page.send(type="set", name="cohesion_weight", value=0.1)
    page.send(type="set", name="fov", value=1000)
    page.ask(
        "document.querySelectorAll('details').forEach((one) => { one.open = true; })"
    )
    page.ask("boidsweep.view.hand.mark(2)")
    page.until("boidsweep.view.status.words.textContent.includes('1000')")
    page.until("boidsweep.view.stage.selection && boidsweep.view.rules.length")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_has_a_name_a_visible_focus_and_enough_contrast(
    opened: Open, scheme: str
) -> None:
    page = opened()
    page.page.emulate_media(color_scheme=scheme)
    everything_open(page)
    assert page.page.get_by_role("heading", level=1).all_inner_texts() == ["boidsweep"]
    assert not troubles(
        page, "nameless", "doubled", "disordered", "unmarked", "faint", "faintly_drawn"
    )
    for opener in ("Keys", "Choose metrics"):
        page.page.get_by_role("button", name=opener).click()
        assert not troubles(page, "nameless", "faint", "overflowing")
        page.page.keyboard.press("Escape")


def test_there_is_room_for_everything(opened: Open) -> None:
    page = opened()
    everything_open(page)
    assert not troubles(page, "overflowing")
    assert min(np.subtract(picture(page), (600, 500))) >= 0


def test_all_is_reached_on_a_phone_and_at_four_hundred_per_cent(
    opened: Open,
) -> None:
    """320 by 256 pixels are left of 1280 by 1024 then."""
    page = opened()
    everything_open(page)
    page.ask("boidsweep.view.status.say('')")
    for width, height in ((390, 844), (640, 360), (844, 390), (320, 480), (320, 256)):
        page.page.set_viewport_size({"width": width, "height": height})
        assert not troubles(page, "overflowing", "hidden_away"), (width, height)
        assert picture(page)[1] >= 180


def picture(page: Opened) -> tuple[float, float]:
    """Width and height of the picture."""
    box = page.page.locator(".picture").bounding_box()
    assert box
    return box["width"], box["height"]


def test_there_is_room_for_fingers_on_a_tablet(opened: Open) -> None:
    """They select and draw; then everything has room when everything is open."""
    page = opened(viewport={"width": 820, "height": 1180}, has_touch=True)
    assert page.ask("matchMedia('(pointer: coarse)').matches")
    x, y = page.ask(
        "[boidsweep.view.stage.trail.at(-1).x[5],"
        " boidsweep.view.stage.trail.at(-1).y[5]]"
    )
    page.page.touchscreen.tap(*page.place(x, y))
    page.until("boidsweep.view.stage.selection?.boid === 5")
    page.page.get_by_role("button", name="Draw a disc").tap()
    page.page.touchscreen.tap(*page.place(400, 300))
    page.until("boidsweep.view.stage.scene.obstacles.length === 19")
    everything_open(page)
    for width, height, least in (
        (820, 1180, (700, 400)),
        (1180, 820, (500, 500)),
        (600, 900, (500, 230)),
    ):
        page.page.set_viewport_size({"width": width, "height": height})
        assert not troubles(page, "overflowing", "small")
        assert min(np.subtract(picture(page), least)) >= 0


def test_a_menu_is_used_by_keyboard(opened: Open) -> None:
    page = opened()
    page.page.get_by_role("button", name="Export").press("Enter")
    focused = "document.activeElement.textContent"
    assert page.ask(focused).startswith("PNG")
    for _ in range(2):
        page.page.keyboard.press("ArrowDown")
    assert page.ask(focused).startswith("SVG")
    page.page.keyboard.press("Escape")
    assert page.ask(focused) == "Export"
    assert page.page.get_by_role("menu").count() == 0
