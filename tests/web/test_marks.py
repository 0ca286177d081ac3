"""The marks of a figure in the explorer: by keys, by a rectangle, and by a click."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Page, expect

from sweep.explorer.site import explorer
from sweep.web.server import PageServer
from tests import plotted
from tests.studies import SMALL, launched, relaunch
from tests.web.chromium import in_a_thread

BOARD = "window.explorer.figure.boards[0]"


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    for name in ("small", "grid"):
        results = plotted.study(name).store.folder.parent
    with in_a_thread(explorer(results, None)[0]) as server:
        yield server


def chosen(page: Page) -> list[str]:
    """The points that the address names."""
    found = parse_qs(urlsplit(page.url).fragment)
    return found.get("point", [""])[0].split()


def drawn(page: Page, address: str) -> None:
    """Open a figure, and wait until its marks have places."""
    page.goto(address)
    page.wait_for_function(f"() => {BOARD}?.placeOf({BOARD}.dots[0])?.x > 0")


def places(page: Page) -> list[dict[str, Any]]:
    """The places of all marks on the screen, and the points behind them."""
    found: list[dict[str, Any]] = page.evaluate(
        f"""() => {{
          const board = {BOARD};
          const {{ left, top }} = board.element.getBoundingClientRect();
          return board.dots.map((dot) => {{
            const {{ x, y }} = board.placeOf(dot);
            return {{ x: left + x, y: top + y, point: dot.point }};
          }});
        }}"""
    )
    return found


def test_arrow_keys_go_from_cell_to_cell_and_enter_chooses(
    page: Page, server: PageServer
) -> None:
    drawn(page, f"{server.url}#study=grid&metric=speed&kind=heatmap")
    points = plotted.study("grid").points
    board = page.get_by_role("application", name="separation weight").first
    board.focus()
    for key in ("Home", "ArrowRight", "ArrowRight", "ArrowUp", "ArrowLeft"):
        page.keyboard.press(key)
    tip = page.locator(".figure .tip").first
    # Where one is, the value with its interval, and of how many trials.
    for words in (
        "borders = torus",
        "separation weight: 1",
        "speed (px/step): ",
        " (95 % confidence interval)",
        "3 trials; click to play the median",
    ):
        expect(tip).to_contain_text(words)
    page.keyboard.press("Enter")
    expect(page.locator("[aria-label=trials] h2")).to_contain_text(
        "separation weight 1"
    )
    (point,) = chosen(page)
    assert tuple(points.loc[point, ["separation_weight", "borders"]]) == (1, "torus")
    # The board is still there, and has the keyboard.
    assert page.evaluate(f"document.activeElement === {BOARD}.element")
    page.keyboard.press("ArrowDown")
    page.keyboard.press(" ")
    expect(page.locator("[aria-label=trials] h2")).to_have_text("Trials of 2 points")
    assert len(chosen(page)) == 2
    page.keyboard.press(" ")
    expect(page.locator("[aria-label=trials] h2")).to_contain_text(
        "separation weight 1"
    )
    assert chosen(page) == [point]


@pytest.mark.parametrize("address", ["small&kind=scatter", "grid&kind=heatmap"])
def test_a_rectangle_chooses_the_points_within(
    page: Page, server: PageServer, address: str
) -> None:
    drawn(page, f"{server.url}#study={address}&metric=speed")
    marks = places(page)
    within = [one for one in marks if one["x"] <= marks[-1]["x"] - 1]
    page.mouse.move(
        min(one["x"] for one in marks) - 9, min(one["y"] for one in marks) - 9
    )
    page.mouse.down()
    right, lowest = max(one["x"] for one in within), max(one["y"] for one in marks)
    page.mouse.move(right + 9, lowest + 9, steps=3)
    expect(page.locator(".brush").first).to_be_visible()
    page.mouse.up()
    expect(page.locator(".brush").first).to_be_hidden()
    expect(page.locator("[aria-label=trials] h2")).to_be_visible()
    assert sorted(chosen(page)) == sorted(one["point"] for one in within)
    expect(page.locator("[aria-label=points] tr.chosen")).to_have_count(len(within))


def test_keys_draw_a_rectangle_too(page: Page, server: PageServer) -> None:
    drawn(page, f"{server.url}#study=grid&kind=heatmap&metric=speed")
    points = plotted.study("grid").points
    page.locator(".board").first.focus()
    page.keyboard.press("Home")
    for key in ("Shift+ArrowRight", "Shift+ArrowDown", "Shift+ArrowUp"):
        page.keyboard.press(key)
    brush = page.locator(".brush").first
    expect(brush).to_be_visible()
    page.keyboard.press("Escape")
    expect(brush).to_be_hidden()
    assert chosen(page) == []
    for key in ("Home", "Shift+ArrowRight", "Shift+ArrowUp", "Shift+ArrowUp", "Enter"):
        page.keyboard.press(key)
    expect(brush).to_be_hidden()
    page.wait_for_function("() => location.hash.includes('point=')")
    here = points.loc[chosen(page)]
    across, up = here["separation_weight"], here["alignment_weight"]
    assert len(here) == across.nunique() * up.nunique() > 2
    region = parse_qs(urlsplit(page.url).fragment)["region"][0]
    ends = [across.min(), across.max(), up.min(), up.max()]
    told = [float(word) for word in region.replace(",", "").split() if "_" not in word]
    assert told == pytest.approx(ends, rel=1e-5)  # of 6 digits


def test_a_click_beside_all_marks_chooses_nothing_any_more(
    page: Page, server: PageServer
) -> None:
    drawn(page, f"{server.url}#study=small&kind=scatter&metric=speed")
    mark = places(page)[0]
    page.mouse.click(mark["x"], mark["y"])
    page.wait_for_function("() => location.hash.includes('point=')")
    box = page.locator(".board").bounding_box()
    assert box
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + 4)
    page.wait_for_function("() => !location.hash.includes('point=')")
    expect(page.locator("section[aria-label=trials]")).to_be_hidden()


def test_escape_ends_a_rectangle_and_more_than_allowed_is_said(
    page: Page, server: PageServer
) -> None:
    drawn(page, f"{server.url}#study=small&kind=scatter&metric=speed")
    box = page.locator(".board").bounding_box()
    assert box
    page.mouse.move(box["x"] + 20, box["y"] + 5)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] - 5, box["y"] + box["height"] - 5, steps=3)
    expect(page.locator(".brush")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator(".brush")).to_be_hidden()
    page.mouse.up()
    assert chosen(page) == []
    many = "Array.from({ length: 101 }, (_, i) => String(i))"
    page.evaluate(f"window.explorer.figure.choosePoints({many})")
    expect(page.get_by_role("alert").filter(has_text="101 points")).to_be_visible()
    assert chosen(page) == []


def test_intervals_are_drawn_anew_when_something_was_stored(
    page: Page, tmp_path: Path
) -> None:
    """Without a reload, and only then."""
    launched(SMALL, tmp_path)
    half = f"{BOARD}.dots.map(({{ low, high }}) => high - low)"
    with in_a_thread(explorer(tmp_path, "small")[0]) as server:
        drawn(page, f"{server.url}#study=small&metric=dispersion&kind=scatter")
        before = page.evaluate(half)
        page.evaluate(f"window.first = {BOARD}")
        page.locator("[aria-label=points] tbody button").first.click()
        expect(page.locator("[aria-label=trials] h2")).to_be_visible()
        assert page.evaluate(f"window.first === {BOARD}")
        relaunch(SMALL.replace("replicates: 3", "replicates: 12"), tmp_path)
        said = page.locator(".figure .said").first
        expect(said).to_contain_text("12 trials per point")
        after = page.evaluate(half)
        page.goto("about:blank")  # it asks no server that is gone
    assert len(before) == len(after) == 2
    assert sum(after) < sum(before)
