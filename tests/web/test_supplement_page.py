"""The file of a supplement in a real browser, opened from disk with nothing else: its
marks are the numbers of the table, a click plays, a drag leafs through runs.
"""

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page

from sweep.figures.heatmap import UNRESOLVED
from sweep.figures.kinds import KINDS
from sweep.figures.marks import FigureMarks
from sweep.figures.planning import Choices
from sweep.tables.stored_study import StoredStudy
from tests.explorer.supplements import FLOWN, content_of, written
from tests.patience import PATIENCE
from tests.searches import edited
from tests.studies import launched
from tests.web.test_axe import found

GRID = edited(
    FLOWN,
    (
        "separation_weight: [0.5, 1, 2]",
        "separation_weight: [0.5, 1, 2, 4]\n  alignment_weight: [0, 1, 2, 3]",
    ),
)
EVIL = "<img src=x onerror=alert(1)></script>"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("page")
    study = launched(f"# {EVIL}\n{FLOWN}", folder)
    return written(study, folder / "flocks.html", trials=("lowest", "median"))


@pytest.fixture(scope="module")
def gridded(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(GRID, tmp_path_factory.mktemp("page"))


@pytest.fixture(scope="module")
def grid(gridded: StoredStudy) -> Path:
    return written(gridded, gridded.store.folder.parent / "grid.html")


@pytest.fixture
def shown(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens files. They ask for nothing else, and nothing goes wrong in them."""
    wrong: list[str] = []
    pages: list[Page] = []

    def shown(path: Path, query: str = "", **about: Any) -> Page:
        page = browser.new_page(**{"viewport": {"width": 1280, "height": 720}, **about})
        pages.append(page)
        page.route(re.compile("^(?!file:|blob:)"), lambda route: route.abort())
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on(
            "console",
            lambda said: (
                wrong.append(said.text) if said.type in ("error", "warning") else None
            ),
        )
        page.on(
            "request",
            lambda request: (
                None
                if request.url.startswith(path.as_uri())
                else wrong.append(request.url)
            ),
        )
        page.goto(path.as_uri() + query)
        clock(page, r"step 0 of \d+")
        return page

    yield shown
    for page in pages:
        page.close()
    assert wrong == []


def clock(page: Page, words: str) -> None:
    """Wait until the page says which step it shows."""
    page.locator(".clock", has_text=re.compile(words)).wait_for(timeout=1000 * PATIENCE)


def marks(page: Page) -> Locator:
    return page.get_by_role("listbox").first.get_by_role("option")


def middle(mark: Locator) -> tuple[float, float]:
    box = mark.locator(".shape").bounding_box()
    assert box
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_a_click_plays_the_run_of_a_point_to_its_end(
    shown: Callable[..., Page], file: Path
) -> None:
    page, content = shown(file), content_of(file.read_bytes())
    page.mouse.click(*middle(marks(page).nth(2)))
    clock(page, "step 60 of 60")
    page.get_by_role("button", name=re.compile("^Run")).wait_for()
    (trial,) = {content["runs"][content["points"][2]["runs"][0]]["trial"]}
    assert trial in page.get_by_label("replay").inner_text()
    assert "every number equals the stored one" in page.inner_text("main")
    assert f"sweep view small {trial}" in page.inner_text("main")
    page.mouse.click(*middle(marks(page).nth(0)))  # from its beginning
    page.get_by_role("button", name=re.compile("^Pause")).click()


def test_a_drag_leafs_through_the_runs_at_the_same_step(
    shown: Callable[..., Page], file: Path
) -> None:
    page = shown(file)
    page.get_by_role("slider", name="step", exact=True).fill("44")
    clock(page, "step 44 of 60")
    page.mouse.move(*middle(marks(page).nth(0)))
    page.mouse.down()
    seen = set()
    for place in (1, 2):
        page.mouse.move(*middle(marks(page).nth(place)), steps=3)
        clock(page, "step 44 of 60")
        seen.add(page.get_by_label("replay").inner_text())
        assert marks(page).nth(place).get_attribute("aria-selected") == "true"
    page.mouse.up()
    clock(page, "step 44 of 60")
    assert len(seen) == 2


def test_a_page_that_is_loaded_again_shows_the_run_that_was_shown(
    shown: Callable[..., Page], file: Path
) -> None:
    content = content_of(file.read_bytes())
    page = shown(file, "?embed")
    assert "#" not in page.url
    page.mouse.click(*middle(marks(page).nth(2)))
    page.get_by_role("button", name="median", exact=True).click()
    clock(page, "step 60 of 60")
    runs = [content["runs"][one] for one in content["points"][2]["runs"]]
    (trial,) = [run["trial"] for run in runs if "median" in run["roles"]]
    assert page.url.endswith(f"?embed#trial={trial}")
    page.reload()
    clock(page, r"step 0 of \d+")
    assert trial in page.get_by_label("replay").inner_text()
    assert marks(page).nth(2).get_attribute("aria-selected") == "true"
    pressed = page.get_by_role("button", name="median", exact=True)
    assert pressed.get_attribute("aria-pressed") == "true"
    again = shown(file, "?embed#trial=none")
    assert marks(again).nth(0).get_attribute("aria-selected") == "true"


def test_the_keyboard_reaches_every_point(
    shown: Callable[..., Page], file: Path, grid: Path
) -> None:
    page = shown(file)
    marks(page).first.focus()
    for place in (1, 2):
        page.keyboard.press("ArrowRight")
        assert marks(page).nth(place).evaluate("one => one === document.activeElement")
    page.keyboard.press("Enter")
    clock(page, "step 60 of 60")
    page = shown(grid)
    marks(page).first.focus()
    reached = {page.evaluate("supplement.place")}
    for up in range(4):
        for key in ("ArrowRight",) * 3:
            page.keyboard.press(key)
            reached.add(page.evaluate("supplement.place"))
        page.keyboard.press("Home" if up == 3 else "ArrowUp")
        for _ in range(3):
            page.keyboard.press("ArrowLeft")
        reached.add(page.evaluate("supplement.place"))
    assert reached == set(range(16))


def test_the_page_has_the_numbers_of_the_table(
    shown: Callable[..., Page], file: Path
) -> None:
    page, rows = shown(file), content_of(file.read_bytes())["rows"]
    columns = ("separation_weight", "speed", "speed_low", "speed_high", "speed_n")
    for place, row in enumerate(rows):
        cells = page.locator(".means tbody tr").nth(place).locator("td").all()[1:6]
        exact = [float(cell.get_attribute("title") or "") for cell in cells]
        assert exact == [row[name] for name in columns]
        assert [cell.inner_text() for cell in cells] == [f"{one:.6g}" for one in exact]


def test_the_marks_lie_where_the_numbers_say(
    shown: Callable[..., Page], file: Path
) -> None:
    page, rows = shown(file), content_of(file.read_bytes())["rows"]
    x, y = zip(*(middle(marks(page).nth(place)) for place in range(3)), strict=True)
    across = (x[1] - x[0]) / (x[2] - x[0])
    assert across == pytest.approx((1 - 0.5) / (2 - 0.5), abs=0.01)
    ends = []
    for place, row in enumerate(rows):
        box = marks(page).nth(place).locator(".whisker").bounding_box()
        assert box
        ends += [
            (row["speed_high"], box["y"]),
            (row["speed_low"], box["y"] + box["height"]),
        ]
        ends.append((row["speed"], y[place]))
    (most, high), (least, low) = max(ends), min(ends)
    for value, at in ends:
        part = (value - least) / (most - least)
        assert at == pytest.approx(low + part * (high - low), abs=1.5)


def test_a_heatmap_has_the_hatched_cells_of_the_explorer(
    shown: Callable[..., Page], grid: Path, gridded: StoredStudy
) -> None:
    marks_of_explorer = KINDS["heatmap"].marks(
        gridded, Choices(("speed",), x="separation_weight", y="alignment_weight")
    )
    assert isinstance(marks_of_explorer, FigureMarks)
    (panel,) = marks_of_explorer.panels
    resolved = panel.marks["resolved"]
    page = shown(grid)
    hatched = marks(page).filter(has=page.locator("[fill='url(#hatching)']"))
    assert 0 < hatched.count() < len(resolved)
    assert hatched.count() == (~resolved).sum()
    rule = UNRESOLVED.removeprefix("hatched: ")
    assert f"Hatched: {rule}" in page.locator("body").inner_text()


def test_another_trial_of_a_point_can_be_picked(
    shown: Callable[..., Page], file: Path
) -> None:
    page, content = shown(file), content_of(file.read_bytes())
    lowest, median = (content["runs"][place]["trial"] for place in (0, 1))
    group = page.get_by_role("group", name="which trial of the point")
    assert lowest in page.get_by_label("replay").inner_text()
    group.get_by_role("button", name="median").click()
    assert median in page.get_by_label("replay").inner_text()
    assert group.get_by_role("button", name="median").get_attribute("aria-pressed")


def test_texts_of_a_spec_are_shown_as_text(
    shown: Callable[..., Page], file: Path
) -> None:
    page = shown(file)
    page.get_by_text("spec.yaml", exact=True).click()
    assert page.get_by_text(f"# {EVIL}").count() == 1
    assert page.locator("img").count() == 0


def test_an_embedded_page_is_figure_and_run_alone(
    shown: Callable[..., Page], file: Path
) -> None:
    page = shown(file, "?embed")
    assert marks(page).count() == 3
    assert page.locator("canvas").first.is_visible()
    for one in ("h1", ".means", ".watch", "footer"):
        assert not page.locator(one).first.is_visible()


@pytest.mark.parametrize(
    ("width", "scheme"),
    [
        (320, "dark"),
        pytest.param(390, "light", marks=pytest.mark.smoke),
        (1920, "dark"),
    ],
)
def test_the_page_fits_a_window(
    shown: Callable[..., Page], grid: Path, width: int, scheme: str
) -> None:
    page = shown(grid, viewport={"width": width, "height": 800}, color_scheme=scheme)
    wide = page.evaluate("document.documentElement.scrollWidth")
    assert wide <= width
    assert marks(page).count() == 16
    assert found(page) == []


@pytest.mark.parametrize("width", [390, 700, 1280])
def test_the_picture_of_a_run_fills_its_part_of_the_page(
    shown: Callable[..., Page], file: Path, width: int
) -> None:
    """It is as wide as the page on a phone, and half of a screen."""
    page = shown(file, viewport={"width": width, "height": 800})
    least = width - 42 if width <= 860 else width / 2 - 50
    for part in (".player canvas[role=application]", ".player .run"):
        box = page.locator(part).bounding_box()
        assert box
        assert least <= box["width"] <= width
        assert box["height"] > 20


def test_the_page_prints(shown: Callable[..., Page], file: Path) -> None:
    page = shown(file, color_scheme="dark")
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    assert not page.locator(".run").is_visible()
    assert page.locator("details:not([open])").count() == 0
    assert page.pdf().startswith(b"%PDF")
