"""The file of a supplement in a real browser, opened from disk with nothing else: its
marks are the numbers of the table, a click plays, a drag leafs through runs.
"""

import io
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Browser, Locator, Page, expect

from sweep.figures.heatmap import UNRESOLVED
from sweep.figures.kinds import KINDS
from sweep.figures.marks import FigureMarks
from sweep.figures.planning import Choices
from sweep.tables.stored_study import StoredStudy
from sweep.web import document
from sweep.web.encoding import HEAD, SPAN
from tests.explorer.supplements import FLOWN, content_of, written
from tests.patience import PATIENCE
from tests.searches import edited
from tests.studies import launched
from tests.web.scripts import frames_of
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


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page that computes its trials."""
    folder = tmp_path_factory.mktemp("page")
    study = launched(f"# {EVIL}\n{FLOWN}", folder)
    choice = {"compute": True, "metric": "speed", "trials": ("all",)}
    return written(study, folder / "computed.html", **choice)


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


def switch(page: Page) -> Locator:
    return page.get_by_role("checkbox", name="swarms")


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


def test_a_page_computes_and_verifies_its_trials(
    shown: Callable[..., Page], computed: Path
) -> None:
    page = shown(computed)
    counted = page.locator(".verified [role=status]")
    expect(counted).to_have_text(
        "Verified in this browser, bit for bit: 1 of 12 trials."
    )
    card = page.get_by_label("replay")
    expect(card).to_contain_text("stored values at the last frame, bit for bit: speed")
    assert found(page) == []
    page.get_by_role("button", name="Verify all trials").click()
    expect(counted).to_contain_text("12 of 12 trials", timeout=1000 * PATIENCE)
    assert page.get_by_role("button", name="Verify all trials").count() == 0
    page.mouse.click(*middle(marks(page).nth(2)))
    clock(page, "step 60 of 60")


def test_a_reader_changes_settings_of_a_trial(
    shown: Callable[..., Page], computed: Path
) -> None:
    """With the keyboard; the trial comes back as it is stored."""
    page = shown(computed, viewport={"width": 390, "height": 844})
    page.get_by_text("Change settings").click()
    slider = page.get_by_label(re.compile("^alignment weight"))
    slider.press("End")
    card = page.get_by_label("replay")
    expect(card).to_contain_text(
        "with alignment weight 2: not a stored trial", timeout=1000 * PATIENCE
    )
    assert found(page) == []
    wide = page.evaluate("document.documentElement.scrollWidth")
    assert wide <= 390
    page.get_by_role("button", name="As stored").click()
    expect(card).to_contain_text(
        "stored values at the last frame, bit for bit: speed", timeout=1000 * PATIENCE
    )


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
    """With the swarms of its cells too, if cells have room for them."""
    page = shown(grid, viewport={"width": width, "height": 800}, color_scheme=scheme)
    swarms = switch(page)
    assert swarms.is_enabled() == (width > 320)
    if swarms.is_enabled():
        swarms.check()
        page.get_by_role("button", name="Pause swarms").click()
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


class Box(NamedTuple):
    """A part of an image in pixels."""

    left: float
    top: float
    right: float
    bottom: float


EDGE = 9
"""Pixels from the edge of a cell to its world: its colour, and room for half a boid."""
NEAR = 6
"""Sum of the differences of red, green and blue that rounding may cause."""


def coloured(headings: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return red, green and blue of headings: OKLCH with L = 0.58 and C = 0.14, by the
    matrices of Ottosson (2020), https://bottosson.github.io/posts/oklab.
    """
    hue = 2 * np.pi * headings / 256
    lab = np.stack([np.full(hue.shape, 0.58), 0.14 * np.cos(hue), 0.14 * np.sin(hue)])
    to_lms = [
        [1, 0.3963377774, 0.2158037573],
        [1, -0.1055613458, -0.0638541728],
        [1, -0.0894841775, -1.2914855480],
    ]
    to_rgb = [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
    linear = np.clip(to_rgb @ (to_lms @ lab) ** 3, 0, 1)
    low = linear <= 0.0031308
    return np.where(low, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055).T * 255


def recorded(run: dict[str, Any], frame: int) -> NDArray[np.float64]:
    """Return x, y and heading of the boids in a frame of a run."""
    content = frames_of(run)
    size = len(content) // len(run["steps"])
    _, _, _, n, *box = HEAD.unpack_from(content, frame * size)
    at = frame * size + HEAD.size
    x, y = np.frombuffer(content, "<u2", 2 * n, at).reshape(2, n) / SPAN
    heading = np.frombuffer(content, np.uint8, n, at + 4 * n)
    x0, y0, x1, y1 = box
    return np.stack([x0 + x * (x1 - x0), y0 + y * (y1 - y0), heading])


def seen_boids(
    pixels: NDArray[np.uint8],
    box: Box,
    scene: dict[str, Any],
    boids: NDArray[np.float64],
) -> float:
    """Return the fraction of boids that are where they should be, in their colours.

    `box` is the part of a cell that no other cell covers. The world is in its middle,
    as large as there is room for.
    """
    x, y, heading = boids
    wide = box.right - box.left - 2 * EDGE
    tall = box.bottom - box.top - 2 * EDGE
    scale = min(wide / scene["width"], tall / scene["height"])
    upright = 1 if scene["downwards"] else -1
    across = (box.left + box.right) / 2 + (x - scene["width"] / 2) * scale
    along = (box.top + box.bottom) / 2 + upright * (y - scene["height"] / 2) * scale
    wanted = coloured(heading.astype(np.uint8))
    # A browser paints a canvas at whole pixels, and boids at halves of pixels.
    near = [-1, 0, 1]
    away = [
        np.abs(pixels[along.astype(int) + up, across.astype(int) + aside] - wanted)
        for up in near
        for aside in near
    ]
    return float((np.sum(away, axis=2).min(axis=0) < NEAR).mean())


def cell_of(page: Page, point: dict[str, Any]) -> Locator:
    label = re.compile(f"^{re.escape(point['words'])}: ")
    return page.get_by_role("option", name=label).locator(".cell")


def figure_of(
    page: Page, points: list[dict[str, Any]]
) -> tuple[NDArray[np.uint8], list[Box]]:
    """Return the pixels of the figure, and the boxes of cells in these pixels."""
    boxes = []
    for point in points:
        cell = cell_of(page, point)
        left, top, wide, tall = (
            float(cell.get_attribute(name) or "nan")
            for name in ("x", "y", "width", "height")
        )
        boxes.append(Box(left, top, left + wide, top + tall))
    image = Image.open(io.BytesIO(page.locator(".plotted").screenshot()))
    return np.asarray(image.convert("RGB")), boxes


def step_of(page: Page) -> int:
    """Return the step of the swarms on the page."""
    (step,) = re.findall(r"step (\d+) of \d+", page.inner_text(".living"))
    return int(step)


def frames_later(page: Page, frames: int = 30) -> int:
    """Return the step of the swarms after so many frames of the screen."""
    page.evaluate(
        """frames => new Promise((done) => {
          const next = () => (frames-- ? requestAnimationFrame(next) : done());
          next();
        })""",
        frames,
    )
    return step_of(page)


def until_step(page: Page, least: int) -> None:
    """Wait until the swarms have done so many steps."""
    pattern = "|".join(map(str, range(least, 61)))
    expect(page.locator(".living")).to_have_text(re.compile(f"step ({pattern}) of 60"))


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_cells_show_the_boids_of_their_recordings(
    shown: Callable[..., Page], grid: Path, scheme: str
) -> None:
    """A boid may lie below another one: nine of ten are seen. In the frames before and
    after, headings are others.
    """
    page, content = shown(grid, color_scheme=scheme), content_of(grid.read_bytes())
    switch(page).check()
    until_step(page, 10)
    page.get_by_role("button", name="Pause swarms").click()
    step = frames_later(page)
    pixels, boxes = figure_of(page, content["points"])
    runs = [content["runs"][point["runs"][0]] for point in content["points"]]
    shares = [
        np.mean(
            [
                seen_boids(
                    pixels,
                    box,
                    content["scenes"][run["scene"]],
                    boids=recorded(run, frame),
                )
                for run, box in zip(runs, boxes, strict=True)
            ]
        )
        for frame in range(61)
    ]
    assert shares.pop(step) > 0.9
    assert max(shares) < 0.5


def test_cells_have_worlds_of_any_size_above_each_other_or_no_run(
    shown: Callable[..., Page], grid: Path, tmp_path: Path
) -> None:
    """The first cell reaches below the second one, its world is twice as wide, and the
    third cell has no run.
    """
    content = content_of(grid.read_bytes())
    points, runs, scenes = content["points"], content["runs"], content["scenes"]
    run = runs[points[0]["runs"][0]]
    scenes.append({**scenes[run["scene"]], "width": 2 * scenes[run["scene"]]["width"]})
    run["scene"] = len(scenes) - 1
    below, above = (point["cell"]["box"] for point in points[:2])
    points[0]["cell"]["box"] = [
        *(min(below[0], above[0]), max(below[1], above[1])),
        *(min(below[2], above[2]), max(below[3], above[3])),
    ]
    points[0]["cell"]["order"] = -1
    points[2]["runs"] = []
    path = tmp_path / "edited.html"
    path.write_bytes(document("supplement", "supplement", content, "", origin={}))
    page = shown(path)
    switch(page).check()
    page.get_by_role("button", name="Pause swarms").click()
    step = frames_later(page)
    pixels, (first, second, third) = figure_of(page, points[:3])
    if first.right > second.right:
        first = first._replace(left=second.right)
    elif first.left < second.left:
        first = first._replace(right=second.left)
    elif first.top < second.top:
        first = first._replace(bottom=second.top)
    else:
        first = first._replace(top=second.bottom)
    for place, box in enumerate((first, second)):
        run = runs[points[place]["runs"][0]]
        boids = recorded(run, step)
        assert seen_boids(pixels, box, scenes[run["scene"]], boids) > 0.7
    inner = pixels[
        int(third.top) + EDGE : int(third.bottom) - EDGE,
        int(third.left) + EDGE : int(third.right) - EDGE,
    ]
    fill = cell_of(page, points[2]).get_attribute("fill") or ""
    colour = [int(part) for part in re.findall(r"\d+", fill)]
    assert (inner == colour).all(axis=2).mean() > 0.5  # the rest may be hatched


def test_swarms_rest_when_they_are_not_seen(
    shown: Callable[..., Page], grid: Path
) -> None:
    page = shown(grid)
    assert page.locator(".swarms").count() == 0
    switch(page).check()
    until_step(page, 3)
    page.get_by_role("button", name="Pause swarms").click()
    step = step_of(page)
    assert frames_later(page) == step
    page.get_by_role("button", name="Play swarms").click()
    until_step(page, step + 3)
    page.evaluate("scrollTo(0, document.body.scrollHeight)")
    expect(page.locator(".plotted")).not_to_be_in_viewport()
    step = frames_later(page)
    assert frames_later(page) == step
    page.evaluate("scrollTo(0, 0)")
    page.locator(".at", has_not_text=re.compile(f"step {step} of")).wait_for()
    switch(page).uncheck()
    assert page.locator(".swarms").count() == 0


def test_swarms_rest_for_readers_who_want_less_motion_until_they_play_them(
    shown: Callable[..., Page], grid: Path
) -> None:
    page = shown(grid, "#swarms=on", reduced_motion="reduce")
    assert switch(page).is_checked()
    assert frames_later(page) == 60
    page.get_by_role("button", name="Play swarms").click()
    page.locator(".at", has_text=re.compile("step [1-9] of 60")).wait_for()


def test_marks_below_swarms_are_chosen_and_the_address_keeps_both(
    shown: Callable[..., Page], grid: Path
) -> None:
    content = content_of(grid.read_bytes())
    page = shown(grid)
    switch(page).check()
    assert page.url.endswith("&swarms=on")
    box = cell_of(page, content["points"][6]).bounding_box()
    assert box
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    clock(page, "step 60 of 60")
    assert page.evaluate("supplement.place") == 6
    trial = content["runs"][content["points"][6]["runs"][0]]["trial"]
    assert page.url.endswith(f"#trial={trial}&swarms=on")
    page.keyboard.press("Home")
    assert page.evaluate("supplement.place") != 6
    page.reload()
    assert switch(page).is_checked()
    assert page.locator(".swarms").count() == 1
    page.emulate_media(media="print")
    assert not page.locator(".swarms").is_visible()
    assert cell_of(page, content["points"][6]).is_visible()


def test_cells_without_room_have_no_swarms(
    shown: Callable[..., Page], grid: Path, file: Path, tmp_path: Path
) -> None:
    """A wider window would help, or no window would; and curves have no cells."""
    page = shown(grid, viewport={"width": 320, "height": 800})
    assert switch(page).is_disabled()
    assert "widen the window" in page.inner_text(".living")
    page.set_viewport_size({"width": 1280, "height": 720})
    expect(switch(page)).to_be_enabled()
    content = content_of(grid.read_bytes())
    for point in content["points"]:
        box = point["cell"]["box"]
        box[1] = box[0] + 0.001 * (box[1] - box[0])
    path = tmp_path / "small.html"
    path.write_bytes(document("supplement", "supplement", content, "", origin={}))
    assert not switch(shown(path)).is_visible()
    assert switch(shown(file)).count() == 0
