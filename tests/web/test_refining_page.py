"""Refining a study in a browser: a region is dragged, the change is read, and a click
launches it.
"""

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect

from sweep.explorer.site import explorer, site_of
from sweep.explorer.watching import Watched
from sweep.web.launching import Launcher
from sweep.web.live_show import Live
from sweep.web.server import PageServer
from sweep.web.state import begin
from tests import plotted
from tests.patience import PATIENCE
from tests.web.chromium import in_a_thread
from tests.web.test_axe import found

Open = Callable[..., Page]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A spec with its results, and with those of another study."""
    folder = tmp_path_factory.mktemp("refined")
    for name in ("grid", "small", "flying"):
        stored = plotted.study(name).store.folder
        assert isinstance(stored, Path)
        shutil.copytree(stored, folder / "results" / name)
    (folder / "spec.yaml").write_text(plotted.GRID)
    return folder


@pytest.fixture(scope="module")
def launcher(folder: Path) -> Iterator[Launcher]:
    launcher = Launcher(folder / "spec.yaml", folder / "results", ["--workers", "1"])
    yield launcher
    assert launcher.leave() == ""


@pytest.fixture(scope="module")
def server(folder: Path, launcher: Launcher) -> Iterator[PageServer]:
    made = explorer(folder / "results", None, launcher=launcher)[0]
    with in_a_thread(made) as server:
        yield server


@pytest.fixture
def opened(browser: Browser) -> Iterator[Open]:
    """Opens pages, and sees that none has met an error in its script or has broken its
    own rules; a refusal of the server is no error of theirs.
    """
    complaints: list[str] = []
    pages: list[Page] = []

    def opened(address: str, **about: Any) -> Page:
        size = {"viewport": {"width": 1400, "height": 1000}}
        context = browser.new_context(**{**size, **about})
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        page = context.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "console",
            lambda said: complaints.append(said.text) if said.type == "error" else None,
        )
        page.goto(address)
        pages.append(page)
        return page

    yield opened
    for page in pages:
        page.context.close()
    assert [one for one in complaints if "status of 400" not in one] == []


def drag(page: Page, start: tuple[float, float], stop: tuple[float, float]) -> None:
    """Drag across the first panel of the figure, between parts of its size."""
    box = page.locator(".board").first.bounding_box()
    assert box
    for (x, y), act in ((start, page.mouse.down), (stop, page.mouse.up)):
        page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
        act()


def proposal(page: Page) -> Any:
    return page.locator(".refine .proposal")


def test_a_region_is_dragged_read_and_launched(
    opened: Open, server: PageServer, launcher: Launcher, folder: Path
) -> None:
    page = opened(f"{server.url}#study=grid&metric=speed")
    expect(page.locator(".figure canvas").first).to_be_visible()
    drag(page, (0.15, 0.2), (0.45, 0.5))
    head = page.locator(".refine > summary")
    expect(head).to_contain_text(re.compile(r"separation weight \S+ to \S+, align"))
    assert "point=" in page.url  # the same rectangle chooses the points in it
    head.click()
    expect(proposal(page)).to_be_visible()
    region = re.fullmatch(
        r"separation_weight (\S+) (\S+), alignment_weight (\S+) (\S+)",
        page.locator("#region").input_value(),
    )
    assert region
    low, high, bottom, top = map(float, region.groups())
    assert 0.25 < low < 0.75 < high < 2
    assert 0.01 < bottom < 0.1 < top < 3
    expect(page.locator(".region").first).to_be_visible()
    said = page.locator(".refine .difference").inner_text()
    assert said == launcher.proposed(shown(page)).difference
    assert "54 kept, 0 dropped" in said
    assert (folder / "spec.yaml").read_text() == plotted.GRID
    launch = page.locator(".refine .launches button.primary")
    expect(launch).to_have_text(re.compile(r"Write spec\.yaml and launch \d+ trials"))
    launch.click()
    expect(page.locator(".refine .launches .said")).to_contain_text("is running")
    expect(proposal(page)).to_be_hidden()  # it does not ask for the same thing again
    assert (
        not {"region", "point", "parts"} & parse_qs(urlsplit(page.url).fragment).keys()
    )
    assert launcher.started
    assert launcher.started.process.wait(PATIENCE) == 0
    expect(page.locator(".refine .launches .said")).to_contain_text("has finished")
    many = int(re.findall(r"(\d+) to run", said)[0])
    expect(page.locator(".counts")).to_contain_text(f"{54 + many} done")
    assert (folder / "spec.yaml").read_text() != plotted.GRID


def shown(page: Page) -> str:
    """The spec that the page proposes."""
    return str(page.evaluate("explorer.refine.launches.proposal.text"))


def test_the_address_has_the_region_and_a_study_that_is_not_opened_only_says_how(
    opened: Open, server: PageServer
) -> None:
    page = opened(f"{server.url}#study=small&region=separation_weight 0.5 1&parts=4")
    expect(proposal(page)).to_be_visible()
    expect(page.locator(".refine .difference")).to_contain_text("9 added, 6 kept")
    expect(page.locator(".refine .launches button.primary")).to_be_disabled()
    expect(proposal(page)).to_contain_text("a spec of another study")
    expect(proposal(page).locator("code")).to_contain_text("sweep launch spec.yaml")
    page.locator("#replicates").fill("5")
    page.locator("#replicates").press("Enter")
    expect(page.locator(".refine .difference")).to_contain_text("replicates: 3 -> 5")
    page.locator("#region").fill("separation_wieght 0 1")
    page.locator("#region").press("Enter")
    refusal = page.locator(".refine .refusal")
    expect(refusal).to_contain_text('did you mean "separation_weight"')
    expect(proposal(page)).to_be_hidden()


def test_a_point_is_refined_about_and_a_click_is_no_drag(
    opened: Open, server: PageServer
) -> None:
    page = opened(f"{server.url}#study=small")
    expect(page.locator(".figure .board")).to_be_visible()
    page.locator("[aria-label=points] tbody button").first.click()
    page.locator(".refine summary").first.click()
    expect(page.locator(".refine .difference")).to_contain_text("1 added, 2 kept")
    assert "region" not in page.url
    assert "point=" in page.url


def test_points_are_chosen_by_a_box_where_no_axis_is_a_setting(
    opened: Open, server: PageServer
) -> None:
    page = opened(f"{server.url}#study=grid&kind=pareto&metric=speed dispersion")
    expect(page.locator(".figure canvas")).to_be_visible()
    drag(page, (0.01, 0.01), (0.99, 0.99))
    expect(page.locator("[aria-label=trials] h2")).to_contain_text("points")
    assert "region" not in page.url


@pytest.mark.parametrize(
    "scheme", [pytest.param("light", marks=pytest.mark.smoke), "dark"]
)
def test_the_card_is_accessible_and_fits_any_window(
    opened: Open, server: PageServer, scheme: Any
) -> None:
    page = opened(f"{server.url}#study=small&region=separation_weight 0.5 1")
    page.emulate_media(color_scheme=scheme)
    expect(proposal(page)).to_be_visible()
    assert found(page) == []
    for width, height in ((390, 844), (320, 480), (1920, 1080)):
        page.set_viewport_size({"width": width, "height": height})
        wide = "document.querySelector('main').scrollWidth"
        assert page.evaluate(wide) <= width


def test_the_simulator_launches_what_it_shows(opened: Open, folder: Path) -> None:
    launcher = Launcher(folder / "new.yaml", folder / "results", ["--workers", "1"])
    site = site_of(Watched(folder / "results"), launcher)._replace(home="index.html")
    shows = PageServer(lambda: Live(begin("nguyen2024", "as_run")), 0, site)
    with in_a_thread(shows) as server:
        page = opened(server.url)
        expect(page.locator(".status .exact")).to_be_visible()
        page.evaluate("boidsweep.view.send({ type: 'set', name: 'steps', value: 5 })")
        page.get_by_role("button", name="Copy as spec").click()
        expect(page.locator("dialog .difference")).to_contain_text("1 trial to run")
        page.get_by_label("replicates", exact=True).fill("2")
        page.get_by_label("replicates", exact=True).press("Enter")
        expect(page.locator("dialog .difference")).to_contain_text("2 trials to run")
        page.locator("dialog .launches button.primary").click()
        expect(page.locator("dialog .said")).to_contain_text("is running")
        assert launcher.started
        assert launcher.started.process.wait(PATIENCE) == 0
        expect(page.locator("dialog .said")).to_contain_text("has finished")
        with page.context.expect_page() as following:
            page.get_by_role("link", name="Follow the launch in the explorer").click()
        expect(following.value.locator(".counts")).to_contain_text("2 done")
    assert launcher.leave() == ""
    assert (folder / "new.yaml").read_text().startswith("study: view/nguyen2024-")


def test_a_simulator_that_may_not_launch_says_how(opened: Open) -> None:
    with in_a_thread(PageServer(lambda: Live(begin("nguyen2024", "as_run")))) as server:
        page = opened(server.url)
        expect(page.locator(".status .exact")).to_be_visible()
        page.get_by_role("button", name="Copy as spec").click()
        expect(page.locator("dialog[open]")).to_contain_text("sweep launch spec.yaml")
        expect(page.locator("dialog .launches")).to_be_hidden()
