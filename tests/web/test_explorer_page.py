"""The explorer in a browser: from the list of studies to a trial that plays."""

import http.client
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

from sweep.explorer.site import explorer
from sweep.web.server import PageServer
from tests import plotted
from tests.web.chromium import in_a_thread
from tests.web.test_access import CHECKS

PATIENCE = 90_000.0
Open = Callable[..., Page]


@pytest.fixture(scope="module")
def results() -> Path:
    for name in ("small", "grid"):
        plotted.study(name)
    folder = plotted.study("small").store.folder.parent
    assert isinstance(folder, Path)
    return folder


@pytest.fixture(scope="module")
def server(results: Path) -> Iterator[PageServer]:
    with in_a_thread(explorer(results, None)[0]) as server:
        yield server


@pytest.fixture
def opened(browser: Browser, server: PageServer) -> Iterator[Open]:
    """Opens pages, and sees that none has met an error in its script or has broken its
    own rules.
    """
    complaints: list[str] = []
    pages: list[Page] = []

    def opened(address: str = "", **about: Any) -> Page:
        size = {"viewport": {"width": 1400, "height": 900}}
        page = browser.new_context(**{**size, **about}).new_page()
        page.set_default_timeout(PATIENCE)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "console",
            lambda said: complaints.append(said.text) if said.type == "error" else None,
        )
        page.goto(server.url + address)
        pages.append(page)
        return page

    yield opened
    for page in pages:
        page.context.close()
    assert complaints == []


def seen(page: Page, selector: str) -> None:
    """Wait until something is there."""
    expect(page.locator(selector).first).to_be_visible(timeout=PATIENCE)


def test_a_tour_from_the_list_to_a_trial_that_plays(opened: Open) -> None:
    page = opened()
    page.get_by_role("button", name="small", exact=True).click()
    seen(page, ".figure .uplot")
    assert "6 trials at 2 points: 6 done." in page.locator(".counts").inner_text()
    page.locator("[aria-label=points] tbody button").first.click()
    seen(page, "[aria-label=trials] tbody button")
    parts = page.locator("[aria-label=trials] tbody td:last-child").all_inner_texts()
    assert parts == ["worst", "median", "best"]
    page.locator("[aria-label=trials] tbody button").first.click()
    seen(page, ".player .record .exact")
    words = page.locator(".player .record .exact").inner_text()
    assert words == "Every number equals the stored one, bit for bit."
    link = page.get_by_role("link", name="Open in the simulator")
    expect(link).to_be_visible(timeout=PATIENCE)
    address = link.get_attribute("href") or ""
    assert address.startswith("index.html#spec=")
    simulator = opened(address)
    expect(simulator.locator(".status .exact")).to_be_visible(timeout=PATIENCE)
    expect(simulator).to_have_title(re.compile("replicate 3"), timeout=PATIENCE)


def test_a_click_on_a_cell_shows_its_trials_and_the_address_keeps_it(
    opened: Open,
) -> None:
    page = opened("#study=grid&metric=dispersion")
    seen(page, ".figure canvas")
    page.locator(".board canvas").first.click(position={"x": 120, "y": 60})
    seen(page, "[aria-label=trials] tbody button")
    title = page.locator("[aria-label=trials] h2").inner_text()
    assert title.startswith("Trials at separation weight 0.5, alignment weight 1")
    seen(page, "[aria-label=points] tr.chosen")
    assert page.locator("[aria-label=points] tr.chosen").count() == 1
    page.reload()
    seen(page, "[aria-label=trials] tbody button")
    assert page.locator("[aria-label=trials] h2").inner_text() == title


def test_what_is_chosen_is_said_in_the_commands_and_refusals_are_read(
    opened: Open,
) -> None:
    page = opened("#study=grid")
    seen(page, ".figure canvas")
    page.locator("#where").fill("borders=torus")
    page.locator("#where").press("Enter")
    expect(page.locator(".figure code")).to_contain_text("--where borders=torus")
    expect(page.locator("[aria-label=points] code")).to_contain_text("--where borders")
    assert page.locator("[aria-label=points] tbody tr").count() == 9
    page.locator("[aria-label=points] th button", has_text="speed").click()
    expect(page.locator("[aria-label=points] code")).to_contain_text("--sort speed")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_has_a_name_and_contrast_and_fits_any_window(
    opened: Open, scheme: Any
) -> None:
    page = opened("#study=small")
    page.emulate_media(color_scheme=scheme)
    seen(page, ".figure .uplot")
    page.locator("[aria-label=points] tbody button").first.click()
    seen(page, "[aria-label=trials] tbody button")
    found = page.evaluate(CHECKS, ["nameless", "doubled", "unmarked", "faint"])
    assert not found
    for width, height in ((390, 844), (320, 480), (1920, 1080)):
        page.set_viewport_size({"width": width, "height": height})
        wide = "document.querySelector('main').scrollWidth"
        assert page.evaluate(wide) <= width


def asked(server: PageServer, path: str, method: str = "GET", host: str = "") -> Any:
    """Status and content of an answer."""
    address = urlsplit(server.url)
    connection = http.client.HTTPConnection(address.netloc, timeout=60)
    connection.request(method, path, headers={"Host": host or address.netloc})
    response = connection.getresponse()
    content = response.read()
    connection.close()
    return response.status, content, response.headers


def test_only_who_has_the_token_and_asks_this_machine_is_answered(
    server: PageServer,
) -> None:
    path = f"{urlsplit(server.url).path}ask/studies"
    status, content, headers = asked(server, path)
    assert status == 200
    assert headers.get_content_type() == "application/json"
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert {"small", "grid"} <= {one["study"] for one in json.loads(content)["studies"]}
    assert asked(server, "/wrong/ask/studies")[0] == 404
    assert asked(server, path, host="evil.example:80")[0] == 404
    assert asked(server, path, "POST")[0] == 405
    assert asked(server, f"{urlsplit(server.url).path}ask/else")[0] == 404


@pytest.mark.parametrize(
    "query",
    [
        "points",
        "points?study=..%2Fup",
        "points?study=small&metric=%3Cb%3E",
        "points?study=small&where=%00",
        "points?study=small&page=x",
        "trials?study=small&point=x",
        "figure?study=small&kind=%3Cscript%3E",
        "figure?study=small&x=lacking",
        "spec?study=small&trial=zzz",
    ],
)
def test_a_malformed_question_is_answered_by_a_sentence(
    server: PageServer, query: str
) -> None:
    status, content, _ = asked(server, f"{urlsplit(server.url).path}ask/{query}")
    assert status == 400
    assert list(json.loads(content)) == ["error"]
