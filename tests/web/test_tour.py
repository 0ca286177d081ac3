"""The whole way in a browser: a launch is followed, its figure read, its trials played,
a region refined and launched, and the study handed on as one file.
"""

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.cli.test_launching_pages import line_with, started
from tests.commands import sweep
from tests.patience import PATIENCE
from tests.studies import SMALL

BOARD = "window.explorer.figure.boards[0]"
ALLOWED = re.compile(r"status of 400")
"""A study that is not there yet is refused, which the browser logs."""


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    """A page in which nothing goes wrong."""
    complaints: list[str] = []
    page = browser.new_context(viewport={"width": 1500, "height": 1000}).new_page()
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on(
        "console",
        lambda said: complaints.append(said.text) if said.type == "error" else None,
    )
    yield page
    page.context.close()
    assert [one for one in complaints if not ALLOWED.search(one)] == []


def mark(page: Page, number: int) -> tuple[float, float]:
    """The place of a mark of the figure on the screen."""
    page.wait_for_function(f"() => {BOARD}?.placeOf({BOARD}.dots[{number}])?.x > 0")
    place = page.evaluate(
        f"""() => {{
          const {{ left, top }} = {BOARD}.element.getBoundingClientRect();
          const {{ x, y }} = {BOARD}.placeOf({BOARD}.dots[{number}]);
          return [left + x, top + y];
        }}"""
    )
    return (place[0], place[1])


def read_and_play(page: Page) -> None:
    """From a mark of the figure to two trials on one clock."""
    page.mouse.click(*mark(page, 0))
    trials = page.locator("section[aria-label=trials]")
    expect(trials.locator("tbody tr")).to_have_count(3)
    trials.get_by_role("button", name="▶").first.click()
    exact = page.locator(".player .record .exact")
    expect(exact).to_have_text(re.compile("bit for bit"))
    trials.get_by_role("button", name=re.compile("^Play .* beside")).first.click()
    expect(exact).to_have_count(2)
    expect(page.get_by_role("heading", name="Two trials side by side")).to_be_visible()


def refine(page: Page) -> int:
    """Drag a rectangle from mark to mark, and launch what it proposes; how many trials
    these are.
    """
    (left, top), (right, low) = mark(page, 0), mark(page, 1)
    page.mouse.move(left - 9, min(top, low) - 9)
    page.mouse.down()
    page.mouse.move(right + 9, max(top, low) + 9, steps=3)
    page.mouse.up()
    page.locator(".refine > summary").click()
    launch = page.locator(".refine .launches button.primary")
    expect(launch).to_have_text(re.compile(r"launch \d+ trials"))
    (many,) = re.findall(r"\d+", launch.inner_text())
    launch.click()
    said = page.locator(".refine .launches .said")
    expect(said).to_contain_text("has finished")
    return int(many)


@pytest.mark.slow
def test_from_a_launch_to_a_file_for_readers(page: Page, tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL)
    words = ("launch", "spec.yaml", "--show", "--no-open", "--workers", "1")
    with started(tmp_path, *words) as process:
        page.goto(line_with(process, "http://"))
        expect(page.locator(".counts")).to_contain_text("6 done")
        page.locator("#figure-kind").select_option("scatter")
        read_and_play(page)
        more = refine(page)
        expect(page.locator(".counts")).to_contain_text(f"{6 + more} done")
        page.wait_for_function(f"() => {BOARD}.dots.length > 2")
        page.goto("about:blank")  # it would ask on
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
    made = sweep(tmp_path, "show", "small", "--to", "small.html", "--workers", "1")
    assert made.returncode == 0, made.stderr
    page.goto((tmp_path / "small.html").as_uri())
    clock = page.locator(".clock")
    expect(clock).to_have_text("step 0 of 9")
    page.get_by_role("button", name="Play").first.click()
    expect(clock).to_have_text(re.compile(r"step (\d+) of \1\b"))
