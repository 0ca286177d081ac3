"""The explorer in a browser: from the list of studies to a trial that plays."""

import base64
import http.client
import json
import re
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from kernels.models import MODELS
from sweep.cli.progress import ProgressBar
from sweep.explorer.asking import AskFile
from sweep.explorer.drawn import file
from sweep.explorer.site import explorer
from sweep.explorer.watching import Watched
from sweep.published.publications import read_all
from sweep.published.reproducing import reproduce
from sweep.tables.stored_study import StoredStudy
from sweep.web.page import STATIC
from sweep.web.server import PageServer
from sweep.workers.executors import Serial
from tests import plotted
from tests.patience import PATIENCE
from tests.publications import experiments
from tests.web.chromium import in_a_thread
from tests.web.test_access import CHECKS
from tests.web.test_axe import found

Open = Callable[..., Page]


@pytest.fixture(scope="module")
def results() -> Path:
    for name in ("small", "grid", "searched", "profiled"):
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
    expect(page.locator(selector).first).to_be_visible()


ALIGNED = """(selector) => {
  const table = document.querySelector(`${selector} table`);
  const edges = (cell) => {
    const range = document.createRange();
    const texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
    range.selectNodeContents(texts.nextNode() ?? cell);
    const { left, right, bottom } = range.getBoundingClientRect();
    return { left, right, bottom };
  };
  const heads = [...table.tHead.rows[0].cells];
  return [...table.tBodies[0].rows].flatMap((row) =>
    [...row.cells].flatMap((cell, i) => {
      const side = cell.classList.contains("number") ? "right" : "left";
      const apart = Math.abs(edges(cell)[side] - edges(heads[i])[side]);
      const below = Math.abs(edges(cell).bottom - edges(row.cells[0]).bottom);
      return apart < 1 && below < 1 ? [] : [`${cell.textContent}: ${apart} ${below}`];
    })
  );
}"""
"""The cells of a table that are not below their heading, or not on a line."""


@pytest.mark.smoke
def test_a_tour_from_the_list_to_a_trial_that_plays(opened: Open) -> None:
    page = opened()
    row = page.locator("tr", has=page.get_by_role("button", name="small", exact=True))
    expect(row.locator("td").nth(2)).to_have_text("separation weight")
    assert found(page) == []
    row.get_by_role("button").click()
    seen(page, ".figure .board")
    seen(page, "[aria-label=points] tbody button")
    assert page.evaluate(ALIGNED, "[aria-label=points]") == []
    assert "6 trials at 2 points: 6 done." in page.locator(".counts").inner_text()
    page.locator("[aria-label=points] tbody button").first.click()
    seen(page, "[aria-label=trials] tbody button")
    parts = page.locator("[aria-label=trials] tbody td:last-child").all_inner_texts()
    assert parts == ["lowest", "median", "highest"]  # no speed is better
    page.locator("[aria-label=trials] tbody button").first.click()
    seen(page, ".player .record .exact")
    words = page.locator(".player .record .exact").inner_text()
    assert words == "Every number equals the stored one, bit for bit."
    link = page.get_by_role("link", name="Open in the simulator")
    expect(link).to_be_visible()
    assert found(page) == []
    address = link.get_attribute("href") or ""
    assert address.startswith("index.html#spec=")
    simulator = opened(address)
    expect(simulator.locator(".status .exact")).to_be_visible()
    # the number that the row of the trial has
    number = page.locator("[aria-label=trials] tbody tr").first.locator("td").nth(1)
    title = re.compile(rf"replicate {number.inner_text()} \(of 0 to ")
    expect(simulator).to_have_title(title)


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


def test_the_keyboard_stays_where_it_is_when_a_table_changes(opened: Open) -> None:
    page = opened("#study=small")
    heading = page.locator("[aria-label=points] th button", has_text="speed").first
    heading.press("Enter")
    expect(page.locator("[aria-label=points] th[aria-sort=ascending]")).to_have_count(1)
    focused = page.locator(":focus")
    expect(focused).to_contain_text("speed")
    row = page.locator("[aria-label=points] tbody tr").nth(1)
    row.locator("button").press("Enter")
    expect(page.locator("[aria-label=points] tr.chosen :focus")).to_have_count(1)
    trial = page.locator("[aria-label=trials] tbody tr").nth(2).locator("button").first
    words = trial.inner_text()
    trial.press("Enter")
    expect(page.locator("[aria-label=trials] tr.chosen :focus")).to_have_text(words)


def test_a_folder_without_a_study_has_commands_that_launch_one(
    page: Page, tmp_path: Path
) -> None:
    folder = tmp_path / "my results"
    folder.mkdir()
    with in_a_thread(explorer(folder, None)[0]) as server:
        page.goto(server.url)
        seen(page, "[aria-label=studies] code")
        lines = page.locator("[aria-label=studies] code").all_inner_texts()
        hidden = not page.locator(".pages:visible").count()
        wrong = found(page)
        page.close()
    assert hidden
    assert wrong == []
    (*init, model), run = map(shlex.split, lines)
    assert init == ["sweep", "init", "first.yaml", "--model"]
    assert model in MODELS
    assert run == ["sweep", "launch", "first.yaml", "--results", str(folder)]


SIDES = "#a=grid:borders%3Dtorus&b=grid:borders%3Dbounded&metric=speed"


def test_a_tour_of_a_comparison_to_a_trial_of_either_side(opened: Open) -> None:
    page = opened("#study=grid")
    page.get_by_text("Compare with another side").click()
    page.locator("#study-a").fill("grid:borders=torus")
    names = page.locator("#study-names option")
    expect(names.first).to_be_attached()
    values = {one.get_attribute("value") for one in names.all()}
    assert {"grid", "profiled", "searched", "small"} <= values
    assert page.locator("#study-b").get_attribute("list") == "study-names"
    page.locator("#study-b").fill("grid:borders=bounded")
    page.get_by_role("button", name="compare").click()
    seen(page, ".forest canvas")
    card = page.locator("[aria-label=comparison]").bounding_box()
    assert card
    assert card["x"] + card["width"] <= 1400 - card["x"]  # a margin on both sides
    page.locator("#compared-metric").select_option("speed")
    page.locator("#compared-margin").fill("0.25")
    page.locator("#compared-margin").press("Enter")
    expect(page.locator("[aria-label=comparison] code")).to_contain_text(
        "--metric speed --margin 0.25"
    )
    page.locator(".forest canvas").first.click(position={"x": 300, "y": 62})
    for side in "AB":
        seen(page, f"[aria-label='trials of {side}'] tbody button")
    chosen = page.locator("[aria-label=differences] tr.chosen")
    assert chosen.locator("td").all_inner_texts()[:2] == ["0.5", "0.1"]
    table = page.locator("[aria-label='trials of B']")
    table.locator("tbody button").first.click()
    seen(page, "[aria-label=player]:visible .record .exact")
    address = page.url
    page.goto("about:blank")
    page.goto(address)
    seen(page, "[aria-label=differences] tr.chosen")
    seen(page, "[aria-label=player]:visible .record .exact")


def test_an_answer_that_comes_late_does_not_undo_a_later_choice(opened: Open) -> None:
    """A figure is waited for, and meanwhile a trial is chosen."""
    trial = plotted.study("small").trials["trial_id"].iloc[0]
    point = plotted.study("small").points.index[0]
    page = opened("#study=small")
    seen(page, ".figure .board")
    held: list[Route] = []
    page.route(re.compile("ask/figure.*kind=scatter"), lambda route: held.append(route))
    here = f"study=small&point={point}"
    with page.expect_request(re.compile("ask/figure.*kind=scatter")):
        page.evaluate(f"location.hash = '{here}&kind=scatter'")
    page.evaluate(f"location.hash = '{here}&trial={trial}'")
    beside = page.get_by_role("button", name=re.compile("^Play .* beside"))
    expect(beside).to_have_count(2)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(urlsplit(request.url).path))
    held[0].continue_()
    for _ in range(2):
        page.wait_for_event("response", lambda one: "ask/state" in one.url)
    assert not [path for path in asked if path.endswith("ask/trials")]
    expect(beside).to_have_count(2)


def scripts(page: Page) -> dict[str, int]:
    """The scripts that the page has loaded, with their sizes in bytes."""
    found: dict[str, int] = page.evaluate(
        """Object.fromEntries(
          performance.getEntriesByType("resource")
            .filter((one) => one.name.endsWith(".js"))
            .map((one) => [one.name.split("/").at(-1), one.decodedBodySize]),
        )"""
    )
    return found


MOST_SCRIPT = 126_000  # bytes, of all scripts that a view loads before a trial plays
VIEWS = {
    "": "table",
    "#study=small&kind=curves": ".figure .board",
    "#study=small&region=separation_weight 0.5 1": ".refine .proposal",
    "#study=grid&kind=heatmap": ".figure canvas",
    "#study=searched": ".search tbody",
    SIDES: ".forest canvas",
}


@pytest.mark.parametrize("address", VIEWS)
def test_a_view_loads_few_scripts_before_a_trial_plays(
    opened: Open, address: str
) -> None:
    page = opened(address)
    seen(page, VIEWS[address])
    page.wait_for_load_state("networkidle")
    loaded = scripts(page)
    assert loaded["show.js"] == (STATIC / "show.js").stat().st_size
    assert sum(loaded.values()) <= MOST_SCRIPT
    assert "mount.js" not in loaded


AXIS = """async ([values, about, from, to]) => {
  const { Axis } = await import("./axes.js");
  const axis = new Axis(values, about).span(from, to);
  return [axis.label, ...axis.ticks.map(({ text }) => text)];
}"""
LOG = {"label": "noise", "logarithmic": True}
UPWARDS = 248, 0
"""Pixels of an axis that goes up; the others have the numbers of their pixels."""


@pytest.mark.parametrize(
    ("values", "about", "span", "label", "ticks"),
    [
        ([0.03, 40.0], LOG, UPWARDS, "noise", "0.1 1 10"),
        ([2e-8, 3e6], LOG, UPWARDS, "noise", "10⁻⁶ 0.001 1 1000 10⁶"),
        ([0.02, 0.3], LOG, UPWARDS, "noise", "0.02 0.05 0.1 0.2"),
        ([3.0, 9.0], LOG, UPWARDS, "noise", "4 6 8"),
        ([110.0, 130.0], LOG, UPWARDS, "noise", "110 115 120 125 130"),
        ([10, 400], LOG | {"listed": [10, 50, 400]}, (0, 300), "noise", "10 50 400"),
        ([1, 9], {"listed": [*range(1, 10)]}, (0, 90), "", "1 3 5 7 9"),
        (
            [0, 0.002],
            {"label": "speed (m/s)"},
            UPWARDS,
            "speed (10⁻³ m/s)",
            "0 0.5 1 1.5 2",
        ),
        ([0.52, 0.98], {}, (39, 0), "", "0.5 1"),
        ([0.3, 0.9], {}, (39, 0), "", "0.4 0.8"),
        ([0, 200_000], {}, (0, 200), "", "0 100000 200000"),
        (
            [1e-5, 0.1],
            LOG | {"listed": [1e-5, 0.01, 0.1]},
            UPWARDS,
            "noise",
            "10⁻⁵ 0.01 0.1",
        ),
        ([10000.1, 10000.9], {}, UPWARDS, "", "10000.2 10000.4 10000.6 10000.8"),
        ([4.5, 10.5], {"listed": [*range(1, 11)]}, (0, 300), "", "5 6 7 8 9 10"),
        ([0, 3e6], {"label": "trials"}, (0, 300), "trials (10⁶)", "0 1 2 3"),
        ([0, 1], {"names": ["torus", "bounded"]}, (0, 300), "", "torus bounded"),
        ([0.5, 0.5], {}, UPWARDS, "", "0.46 0.48 0.5 0.52 0.54"),
    ],
)
def test_ticks_of_an_axis(
    opened: Open,
    values: list[float],
    about: dict[str, Any],
    span: tuple[int, int],
    *,
    label: str,
    ticks: str,
) -> None:
    """Of the explorer, of supplements and of the simulator: the same."""
    page = opened()
    seen(page, "table")
    shown = page.evaluate(AXIS, [values, about, *span])
    assert shown == [label, *ticks.split()]


def median_of(study: StoredStudy, point: str) -> str:
    """The trial in the middle, by the first metric."""
    own = study.trials[study.trials["point"] == point]
    ordered = own.sort_values(study.metrics[0], kind="stable")["trial_id"]
    return str(ordered.iloc[(len(ordered) - 1) // 2])


def test_a_rectangle_about_several_marks_plays_no_trial(opened: Open) -> None:
    page = opened("#study=grid", reduced_motion="reduce")
    seen(page, ".figure canvas")
    board = page.locator(".board").first
    board.click(position={"x": 120, "y": 60})
    seen(page, ".player .record .exact")
    board.focus()
    for key in ("Home", "Shift+ArrowRight", "Shift+ArrowRight", "Enter"):
        page.keyboard.press(key)
    expect(page.locator("section[aria-label=player]")).to_be_hidden()
    expect(page.locator("section[aria-label=trials] h2")).to_contain_text("points")
    board.click(position={"x": 120, "y": 60})
    seen(page, ".player .record .exact")
    board.click(position={"x": 120, "y": 292})  # beside all marks
    expect(page.locator("section[aria-label=player]")).to_be_hidden()


@pytest.mark.parametrize("size", [(1440, 900), (1024, 768)])
def test_a_click_on_a_cell_plays_its_median_trial_beside_the_figure(
    opened: Open, size: tuple[int, int]
) -> None:
    """Both above the fold; each dot is a trial of the point."""
    width, height = size
    page = opened("#study=grid", viewport={"width": width, "height": height})
    seen(page, ".figure canvas")
    page.locator(".board canvas").first.click(position={"x": 120, "y": 60})
    seen(page, ".player .record .exact")
    choice = parse_qs(urlsplit(page.url).fragment)
    (point,), (trial,) = choice["point"], choice["trial"]
    assert trial == median_of(plotted.study("grid"), point)
    boxes = {
        name: page.locator(name).first.bounding_box()
        for name in (".figure .board", ".player .picture", ".player .run")
    }
    for name, box in boxes.items():
        assert box, name
        assert box["y"] >= 0, name
        assert box["y"] + box["height"] <= height, name
    figure, picture, _ = boxes.values()
    assert figure
    assert picture
    assert figure["x"] + figure["width"] <= picture["x"]
    page.wait_for_function("() => window.explorer.player.played.mounted.view.shown > 0")
    dots = page.locator(".dots i")
    expect(dots).to_have_count(3)
    expect(page.locator(".dots .facts")).to_contain_text("the median")
    before = page.url
    page.locator(".dots i:not(.chosen)").first.click()
    page.wait_for_url(lambda url: url != before)
    other = parse_qs(urlsplit(page.url).fragment)["trial"]
    expect(page.locator("[aria-label=player] .facts").first).to_have_text(other[0])
    page.go_back()
    page.go_back()  # to the figure: the way to the median is no step of its own
    expect(page.locator("section[aria-label=trials]")).to_be_hidden()
    assert found(page) == []


def test_on_a_phone_the_trial_plays_right_below_the_figure(opened: Open) -> None:
    page = opened(
        "#study=grid", viewport={"width": 390, "height": 844}, reduced_motion="reduce"
    )
    seen(page, ".figure canvas")
    page.locator(".board canvas").first.click(position={"x": 120, "y": 60})
    seen(page, ".player .record .exact")
    tops = [
        page.locator(name).first.evaluate("one => one.getBoundingClientRect().top")
        for name in (".figure", "[aria-label=player]", "[aria-label=trials]", ".refine")
    ]
    assert tops == sorted(tops)
    assert page.locator(".player .picture").evaluate("one => one.clientWidth") > 300
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    assert page.evaluate("window.explorer.player.played.mounted.view.shown") == 0


def test_profiles_are_curves_whose_points_lead_to_their_trials(opened: Open) -> None:
    """An exponent is a slope, so both axes are logarithmic."""
    page = opened("#study=profiled&kind=profiles")
    seen(page, ".figure .board")
    caption = page.locator(".figure figcaption").first
    expect(caption).to_have_text("mean squared displacement")
    expect(page.locator(".figure .legend").first).to_contain_text("noise = 0.5")
    page.get_by_role("application", name="mean squared displacement (r²)").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Enter")
    seen(page, "[aria-label=trials] tbody button")
    expect(page.locator(".figure code")).to_contain_text("plot profiled profiles")
    assert found(page) == []


def test_an_address_of_a_figure_that_does_not_suit_leads_to_one_that_does(
    opened: Open,
) -> None:
    page = opened("#study=small&kind=heatmap")
    refusal = page.locator(".figure .refusal").first
    expect(refusal).to_contain_text("needs two varied parameters")
    expect(page.locator("#figure-kind")).to_have_value("heatmap")
    expect(page.locator("#figure-x")).to_be_visible()
    assert found(page) == []
    page.locator("#figure-kind").select_option("profiles")
    expect(refusal).to_contain_text("profiles")
    page.get_by_role("button", name="Show a suitable figure").click()
    seen(page, ".figure .board")
    expect(refusal).to_be_hidden()
    expect(page.locator("#figure-kind")).to_be_visible()
    assert "kind" not in page.url


def test_what_is_chosen_is_marked_before_anything_is_answered(opened: Open) -> None:
    page = opened("#study=grid&kind=heatmap")
    canvas = page.locator(".figure .board canvas").first
    seen(page, ".figure .board canvas")
    held: list[Route] = []
    page.route(re.compile("/state"), lambda route: held.append(route))
    box = canvas.bounding_box()
    assert box
    page.mouse.move(box["x"] + 90, box["y"] + 20)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.8 * box["width"], box["y"] + 200, steps=3)
    page.mouse.up()
    expect(page.locator(".figure .region").first).to_be_visible()
    for route in held:
        route.continue_()
    page.unroute_all(behavior="ignoreErrors")


TRIAL_AT = """() => {
  const [board] = explorer.figure.boards;
  const dot = board.trials.reduce((one, other) => (one.y > other.y ? one : other));
  const { left, top } = board.element.getBoundingClientRect();
  const { x, y } = board.placeOf(dot);
  return [left + x, top + y, dot.trial, dot.point, board.y.last >= dot.y];
}"""


def test_each_trial_is_a_dot_that_a_click_and_the_keyboard_play(opened: Open) -> None:
    page = opened("#study=small&kind=scatter&metric=speed")
    seen(page, ".figure .board")
    assert page.evaluate("explorer.figure.boards[0].trials.length") == 0
    page.get_by_role("checkbox", name="trials").check()
    expect(page.locator(".figure code")).to_contain_text("plot small scatter --trials")
    assert "trials=yes" in page.url
    x, y, trial, point, is_within = page.evaluate(TRIAL_AT)
    assert is_within
    page.mouse.move(x, y)
    stored = plotted.study("small").trials.set_index("trial_id").loc[trial]
    tip = page.locator(".figure .tip")
    expect(tip).to_contain_text(f"speed (px/step): {stored['speed']:.4g}")
    expect(tip).to_contain_text(f"trial {trial[:8]}, replicate {stored['replicate']}")
    page.mouse.click(x, y)
    expect(page).to_have_url(re.compile(f"point={point}&trial={trial}"))
    row = page.locator("[aria-label=trials] tr.chosen button").first
    expect(row).to_contain_text(trial[:8])
    board = page.locator(".figure .board").first
    board.focus()
    for key in ("ArrowRight", "ArrowUp"):
        page.keyboard.press(key)
    here = page.evaluate("explorer.figure.boards[0].picker.here.trial")
    assert here
    expect(tip).to_contain_text(f"trial {here[:8]}")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile(f"trial={here}"))
    assert found(page) == []
    page.goto(f"{page.url.partition('#')[0]}#study=grid&kind=heatmap&trials=yes")
    expect(page.get_by_role("checkbox", name="trials")).to_be_disabled()
    expect(page.locator("#figure-why")).to_contain_text("not for heatmap")


def test_a_figure_is_saved_in_the_width_that_the_address_names(
    opened: Open, results: Path
) -> None:
    page = opened("#study=grid&kind=scatter&metric=speed")
    seen(page, ".figure .board")
    page.locator("#figure-width").select_option("89")
    expect(page.locator(".figure code")).to_contain_text("--width 89")
    assert "width=89" in page.url
    button = page.locator(".figure .files").get_by_role("button", name="SVG")
    with page.expect_download() as download:
        button.press("Enter")
    assert download.value.suggested_filename == "scatter-speed.svg"
    question = AskFile("grid", "scatter", ("speed",), width="89", format="svg")
    content = base64.b64decode(file(Watched(results), question)["base64"])
    assert Path(download.value.path()).read_bytes() == content
    expect(button).to_be_focused()
    page.route(re.compile("ask/file"), lambda route: route.fulfill(body="no file"))
    button.press("Enter")
    expect(page.locator(".figure")).to_contain_text("The file was not drawn")


def test_the_simulator_loads_when_a_trial_plays(opened: Open) -> None:
    trial = plotted.study("small").trials["trial_id"].iloc[0]
    page = opened(f"#study=small&trial={trial}")
    seen(page, ".player .record .exact")
    assert {"mount.js", "view.js", "stage.js"} <= scripts(page).keys()


def test_a_winner_of_a_search_leads_to_its_held_out_trials(opened: Open) -> None:
    page = opened("#study=searched")
    seen(page, ".search tbody button")
    expect(page.locator(".figure code")).to_contain_text("plot searched history")
    page.locator(".search tbody button").first.click()
    seen(page, "[aria-label=trials] tbody button")
    title = page.locator("[aria-label=trials] h2").first.inner_text()
    assert title.startswith("Trials at phase held_out")
    page.locator("#figure-kind").select_option("front")
    expect(page.locator(".figure code")).to_contain_text("plot searched front")
    seen(page, "[aria-label=trials] tbody button")


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a tiny publication, which is judged."""
    folder = tmp_path_factory.mktemp("judged")
    experiments(folder)
    publications = read_all(folder / "experiments", quick=False, only=())
    reproduce(publications, folder / "results", Serial(), ProgressBar)
    return folder / "results"


@pytest.fixture(scope="module")
def judged(reproduced: Path) -> Iterator[str]:
    """The address of an explorer of it."""
    with in_a_thread(explorer(reproduced, None)[0]) as server:
        yield server.url


def test_a_new_scorecard_is_shown_without_a_reload_and_an_old_one_is_left_alone(
    opened: Open, judged: str, reproduced: Path
) -> None:
    page = opened()
    page.goto(f"{judged}#scorecard=full")
    claim = page.get_by_role("row").filter(has_text="start-speed")
    expect(claim).to_contain_text("confirmed")
    page.evaluate("document.querySelector('tbody tr').before_it = true")
    for _ in range(2):
        page.wait_for_event("response", lambda one: "ask/scorecard" in one.url)
    assert page.evaluate("document.querySelector('tbody tr').before_it")
    file = reproduced / "scorecard.json"
    before = file.read_text()
    content = json.loads(before)
    for row in content["rows"]:
        row["status"] = "undecided"
    file.write_text(json.dumps(content))
    try:
        expect(claim).to_contain_text("undecided")
    finally:
        file.write_text(before)


def test_a_claim_leads_to_its_figure_and_a_trial_that_plays(
    opened: Open, judged: str
) -> None:
    page = opened()
    page.goto(judged)
    page.get_by_role("link", name="Scorecard, full scale").click()
    expect(page.get_by_role("row").filter(has_text="start-speed")).to_contain_text("✓")
    verdicts = page.get_by_label("verdict")
    options = verdicts.locator("option").all_inner_texts()
    rows = page.locator("[aria-label=scorecard] tbody tr:visible")
    all_claims = rows.count()
    assert options[0] == f"all ({all_claims})"
    for words in options[1:]:
        told = re.fullmatch(r"(\S+) (.+) \((\d+)\)", words)
        assert told
        mark, status, number = told.groups()
        verdicts.select_option(status)
        expect(rows).to_contain_text([f"{mark} {status}"] * int(number))
    verdicts.select_option("confirmed")
    page.reload()
    expect(verdicts).to_have_value("confirmed")
    page.get_by_role("button", name="start-speed").click()
    seen(page, "[aria-label=claim] img")
    wide = "document.querySelector('img.shown').naturalWidth"
    page.wait_for_function(f"{wide} > 100")
    page.locator("[aria-label=trials]:visible tbody button").first.click()
    seen(page, "[aria-label=player]:visible .record .exact")
    page.get_by_role("link", name="figure and points of tiny/small").click()
    seen(page, ".figure canvas")
    expect(page.locator("#where")).to_have_value("separation_weight=1")
    seen(page, "[aria-label=trials]:visible tbody button")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(
    ("address", "parts"),
    [
        (SIDES, [".forest canvas", "[aria-label=differences] tbody button"]),
        ("#study=searched", [".figure .board canvas", ".search tbody button"]),
    ],
)
def test_other_views_have_names_and_contrast_and_fit_any_window(
    opened: Open, scheme: Any, address: str, parts: list[str]
) -> None:
    page = opened(address)
    page.emulate_media(color_scheme=scheme)
    for part in parts:
        seen(page, part)
    found = page.evaluate(CHECKS, ["nameless", "doubled", "unmarked", "faint"])
    assert not found
    for width, height in ((390, 844), (320, 480), (1920, 1080)):
        page.set_viewport_size({"width": width, "height": height})
        wide = "document.querySelector('main').scrollWidth"
        assert page.evaluate(wide) <= width


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_everything_has_a_name_and_contrast_and_fits_any_window(
    opened: Open, scheme: Any
) -> None:
    page = opened("#study=small")
    page.emulate_media(color_scheme=scheme)
    seen(page, ".figure .board")
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
    connection = http.client.HTTPConnection(address.netloc, timeout=PATIENCE)
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
        "figure?study=small&width=1e9",
        "file?study=small&format=..%2Fup",
        "spec?study=small&trial=zzz",
        "compare?a=small",
        "compare?a=small&b=%00",
        "search?study=small",
        "scorecard?scale=..%2F..",
        "picture?study=tiny&claim=..%2Fup",
    ],
)
def test_a_malformed_question_is_answered_by_a_sentence(
    server: PageServer, query: str
) -> None:
    status, content, _ = asked(server, f"{urlsplit(server.url).path}ask/{query}")
    assert status == 400
    assert list(json.loads(content)) == ["error"]
