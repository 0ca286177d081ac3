"""Two stored trials side by side in the explorer: one clock, and the difference of
their series.
"""

import asyncio
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

from sweep.errors import ChoiceError
from sweep.explorer.site import explorer, site_of
from sweep.explorer.watching import Watched
from sweep.tables.stored_study import StoredStudy
from sweep.web import messages
from sweep.web.replaying import Replay
from sweep.web.rooms import Rooms
from sweep.web.server import PageServer
from sweep.web.twin import Twin
from tests import plotted
from tests.web.chromium import in_a_thread
from tests.web.test_axe import found
from tests.web.test_going_on import free_port


class Told:
    """A line that keeps what a page is told."""

    def __init__(self) -> None:
        self.heard: list[Any] = []

    async def tell(self, reply: Any) -> None:
        self.heard.append(reply)


@pytest.fixture(scope="module")
def study() -> StoredStudy:
    return plotted.study("small")


@pytest.fixture(scope="module")
def server(study: StoredStudy) -> Iterator[PageServer]:
    results = study.store.folder.parent
    with in_a_thread(explorer(results, None)[0]) as server:
        yield server


def begun(study: StoredStudy, first: str, second: str) -> Any:
    """The show of a page that asks for these trials."""
    site = site_of(Watched(study.store.folder.parent))
    rooms = Rooms(lambda: Replay(study, first), site.stored)
    hello = messages.Hello("page", study=study.name, trial=first, beside=second)
    line: Any = Told()
    # The browser of other tests has a loop in this thread.
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(asyncio.run, rooms.player(hello, line)).result().show


def test_a_page_that_names_two_trials_gets_both_at_the_same_step(
    study: StoredStudy,
) -> None:
    first, _, last, *_ = study.trials["trial_id"]
    show = begun(study, first, last)
    assert isinstance(show, Twin)
    show.handle(messages.Seek(5))
    shown = [side.status()["replay"] for side in show.sides]
    assert [one["trial"] for one in shown] == [first, last]
    assert [one["replicate"] for one in shown] == [0, 2]
    assert [one["equal"] for one in shown] == [True, True]
    assert [side.step for side in show.sides] == [5, 5]
    assert isinstance(begun(study, first, ""), Replay)


def test_a_second_trial_that_is_not_there_is_refused(study: StoredStudy) -> None:
    first = study.trials["trial_id"].iloc[0]
    with pytest.raises(ChoiceError, match="unknown trial"):
        begun(study, first, "zz")


def choice_of(page: Page) -> dict[str, str]:
    """What the address says."""
    found = parse_qs(urlsplit(page.url).fragment)
    return {name: values[0] for name, values in found.items()}


def test_a_second_trial_plays_beside_the_first_one_on_its_clock(
    page: Page, server: PageServer, study: StoredStudy
) -> None:
    page.emulate_media(reduced_motion="reduce")  # so that no trial runs by itself
    points = list(study.points.index)
    page.goto(f"{server.url}#study=small&point={points[0]}")
    rows = page.locator("[aria-label=trials] tbody tr")
    expect(rows).to_have_count(3)
    assert not page.get_by_role("button", name="beside").count()
    rows.nth(0).locator("button").first.click()
    expect(page.locator(".player .record .exact")).to_be_visible()
    # The second one is of another point; the first one goes on meanwhile.
    page.locator("[aria-label=points] tbody button").nth(1).click()
    expect(page.locator("[aria-label=trials] h2")).to_contain_text(
        "separation weight 1"
    )
    expect(page.locator(".player .record .exact")).to_be_visible()
    rows.nth(2).get_by_role("button", name="beside").click()
    expect(page.locator(".twins .differences canvas").first).to_be_visible()
    expect(page.locator(".head-of-side .differing").nth(1)).to_contain_text(
        "separation weight 1, "
    )
    assert found(page) == []
    page.get_by_role("slider", name="step", exact=True).press("ArrowRight")
    views = "const { view, second } = window.explorer.player.played.mounted"
    page.wait_for_function(f"() => {{ {views}; return view.shown === 1; }}")
    step, one, other = page.evaluate(
        f"""() => {{
          {views};
          const [first, last] = [view, second].map(({{ charts }}) =>
            charts.seriesOf("speed").values[1]);
          return [second.shown, first, last];
        }}"""
    )
    assert step == 1
    # The plot is drawn after the frames, and says four digits.
    reading = page.locator(".differences .plot", has_text="speed").locator(".reading")
    expect(reading).to_have_text(f"{other - one:.4g}")
    before = choice_of(page)
    assert before["trial"] != before["beside"]
    page.reload()
    expect(page.locator(".twins .differences canvas").first).to_be_visible()
    page.get_by_role("button", name="Only B").click()
    expect(page.locator(".twins")).to_have_count(0)
    after = choice_of(page)
    assert (after["trial"], "beside" in after) == (before["beside"], False)
    link = page.get_by_role("link", name="in the simulator")
    expect(link).to_have_count(1)


def test_trials_that_were_gone_to_are_shown_again_by_another_server(
    browser: Browser, study: StoredStudy
) -> None:
    """In the player itself; the address says them, so that a reload finds them too."""
    page = browser.new_context(viewport={"width": 1300, "height": 900}).new_page()
    results, port = study.store.folder.parent, free_port()
    first, second, third, *_ = study.trials["trial_id"]
    replay = page.locator(".player .record")
    said = page.locator("[aria-label=player] .facts").first
    with in_a_thread(explorer(results, None, port)[0]) as server:
        point = study.points.index[0]
        page.goto(f"{server.url}#study=small&point={point}&trial={first}")
        expect(replay).to_contain_text(first)
        page.get_by_role("button", name="All controls").click()
        page.get_by_label("replicate", exact=True).fill("2")
        page.get_by_label("replicate", exact=True).press("Enter")
        expect(replay).to_contain_text(third)
        expect(said).to_have_text(third)
        assert choice_of(page)["trial"] == third
    expect(page.locator(".player .banner")).to_contain_text("connection is lost")
    with in_a_thread(explorer(results, None, port)[0]):
        expect(page.locator(".player .banner")).to_be_hidden()
        expect(replay).to_contain_text(third)
        page.reload()
        expect(replay).to_contain_text(third)
        page.goto(f"{page.url}&beside={second}")
        expect(page.locator(".head-of-side")).to_have_count(2)
        beside = page.locator(".twins [aria-label='run B']")
        page.get_by_role("button", name="All controls").click()
        beside.get_by_label("replicate", exact=True).fill("0")
        beside.get_by_label("replicate", exact=True).press("Enter")
        expect(said).to_have_text(f"{third} and {first}")
        assert choice_of(page) | {"trial": third, "beside": first} == choice_of(page)
    page.context.close()
