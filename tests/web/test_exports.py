"""The menu of files: pictures as they are on the screen, what cannot be made, and how
far a file is.
"""

import base64
import io
import threading
import xml.etree.ElementTree as Tree
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator

import sweep.web.filing as filing
from sweep.errors import OutputError
from sweep.trial import looking
from sweep.web.filing import Make, StoppedError, Tell, untold
from sweep.web.live_show import Live
from sweep.web.messages import Origin
from sweep.web.protocol import Reply
from sweep.web.state import begin
from tests.web.chromium import Opened, in_the_cafeteria, running_server

Open = Callable[..., Opened]
SVG = "{http://www.w3.org/2000/svg}"


def sociable(page: Opened) -> int:
    """The boid that sees most others."""
    show = page.show
    assert isinstance(show, Live)
    seen = [looking.seen_by(show.simulation, boid) for boid in range(show.n)]
    return int(np.argmax([len(one.neighbours) for one in seen]))


def shown(opened: Open) -> Opened:
    """A page on which there is something to see of each kind."""
    page = opened()
    page.send(type="overlays", names=["coverage", "accelerations", "flocks"])
    page.send(type="step", count=40)
    page.until("boidsweep.view.stage.frame.step === 40 && !boidsweep.view.asked")
    page.send(type="select", boid=sociable(page))
    page.until("boidsweep.view.stage.selection && boidsweep.view.stage.coverage")
    page.ask("boidsweep.view.stage.zoom(1.5, { x: 300, y: 200 })")
    return page


def item(page: Opened, words: str) -> Locator:
    """An item of the menu, by its name or its hint, when the menu is open."""
    page.page.get_by_role("button", name="Export").click()
    named = page.page.get_by_text(words, exact=True)
    return page.page.get_by_role("menuitem").filter(has=named)


def exported(page: Opened, words: str, tmp_path: Path) -> tuple[str, bytes]:
    """The name and the bytes of a file that the menu gives."""
    chosen = item(page, words)
    with page.page.expect_download() as download:
        chosen.click()
    download.value.save_as(tmp_path / "file")
    return download.value.suggested_filename, (tmp_path / "file").read_bytes()


def origin(page: Opened) -> Reply:
    """What a picture of the frame says of itself."""
    show = page.show
    assert isinstance(show, Live)
    return show.handle(Origin())[0]


@pytest.mark.parametrize(
    ("finer", "words"),
    [(2, "twice as fine as a screen, 192 dpi"), (4, "four times as fine, 384 dpi")],
)
def test_a_picture_as_shown_has_the_pixels_of_the_screen_and_its_origin(
    opened: Open, tmp_path: Path, finer: int, words: str
) -> None:
    page = shown(opened)
    name, content = exported(page, words, tmp_path)
    said = origin(page)
    assert name == f"{said['name']}-as-shown-{96 * finer}dpi.png"
    with Image.open(io.BytesIO(content)) as image:
        image.load()
        assert {key: image.info[key] for key in said["about"]} == said["about"]
        assert image.info["dpi"] == pytest.approx((96 * finer, 96 * finer), abs=0.1)
        pixels = image.convert("RGB")
        sides = page.ask("[boidsweep.view.stage.width, boidsweep.view.stage.height]")
        assert pixels.size == tuple(finer * side for side in sides)
        small = np.asarray(pixels.resize(sides, Image.Resampling.BOX), np.float64)
    address = page.ask("boidsweep.view.canvas.toDataURL().split(',')[1]")
    with Image.open(io.BytesIO(base64.b64decode(address))) as image:
        screen = np.asarray(image.convert("RGB"), np.float64)
    assert np.abs(small - screen).mean() < 2.5
    assert "study:" in said["about"]["Spec"]
    assert said["about"]["Step"] == "40"


def test_a_picture_as_lines_has_every_layer(opened: Open, tmp_path: Path) -> None:
    page = shown(opened)
    name, content = exported(page, "as lines", tmp_path)
    said, show = origin(page), page.show
    assert isinstance(show, Live)
    assert name == f"{said['name']}-as-shown.svg"
    root = Tree.fromstring(content)
    assert root.findtext(f"{SVG}title") == said["name"]
    told = root.findtext(f"{SVG}desc") or ""
    assert said["about"]["Spec"] in told
    assert f"Trial: {show.state.job.trial_id}" in told
    paths = [str(path.get("d")) for path in root.iter(f"{SVG}path")]
    triangles = [path for path in paths if path.count("L") == 2 and "A" not in path]
    assert len(triangles) == show.n + 1  # the selected one again
    boids = page.ask(
        "Array.from(boidsweep.view.stage.screenX, (x, i) => [x,"
        " boidsweep.view.stage.screenY[i]])"
    )
    for (x, y), path in zip(boids, triangles, strict=False):
        corners = [float(one) for one in path.replace("M", "L").split("L")[1].split()]
        assert np.hypot(corners[0] - x, corners[1] - y) < 8
    assert len(list(root.iter(f"{SVG}image"))) == 1
    seen = looking.seen_by(show.simulation, sociable(page))
    assert len(seen.neighbours) > 0
    assert any(path.count("M") == len(seen.neighbours) for path in paths)
    assert any(
        text.text == "100 px" or "px" in str(text.text)
        for text in root.iter(f"{SVG}text")
    )


def test_an_svg_of_many_boids_has_each_of_them(opened: Open) -> None:
    page = opened()
    page.send(type="set", name="n", value=400)
    page.until("boidsweep.view.stage.frame.n === 400 && !boidsweep.view.asked")
    drawn = page.ask(
        "boidsweep.view.stage.lines().parts.filter((one) =>"
        " one.startsWith('<path') && one.split('L').length === 3).length"
    )
    assert drawn == 400


def test_what_cannot_be_made_is_grey_and_says_why(opened: Open) -> None:
    page = opened()
    page.send(type="step", count=5)
    page.until("boidsweep.view.stage.frame.step === 5 && !boidsweep.view.asked")
    page.send(type="set", name="cohesion_weight", value=0.5)
    page.until("!boidsweep.view.state.exact")
    gif = item(page, "GIF")
    assert gif.get_attribute("aria-disabled") == "true"
    assert "cohesion_weight changed, last at step 5" in gif.inner_text()
    gif.click(force=True)
    assert gif.is_visible()
    assert page.page.locator(".making").is_hidden()
    assert (
        page.page.get_by_role("menuitem", name="SVG").first.get_attribute(
            "aria-disabled"
        )
        == "false"
    )


def test_a_film_without_ffmpeg_is_said_before_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def missing() -> str:
        raise OutputError("MP4 needs ffmpeg")

    filing._lacking.cache_clear()
    monkeypatch.setattr(filing, "find_ffmpeg", missing)
    assert filing.unavailable("") == {"mp4": "MP4 needs ffmpeg"}
    filing._lacking.cache_clear()
    assert set(filing.unavailable("because")) == {"gif", "mp4", "html"}


def test_a_file_says_how_far_it_is() -> None:
    show = Live(begin("nguyen2024", "as_run").with_settings({"n": 5, "steps": 40}))
    show.take_steps(30)
    show.advance(30)
    told: list[tuple[str, float]] = []
    file = show.export("gif")(lambda doing, share: told.append((doing, share)))
    assert file["name"].endswith(".gif")
    assert [doing for doing, _ in told] == sorted(
        (doing for doing, _ in told), reverse=True
    )
    for doing in ("run again", "drawn"):
        shares = [share for one, share in told if one == doing]
        assert shares == sorted(shares)
        assert 0 <= shares[0] <= shares[-1] <= 1
    assert len([one for one in told if one[0] == "drawn"]) == 31


def test_a_file_that_is_not_wanted_any_more_is_not_made() -> None:
    show = Live(begin("nguyen2024", "as_run").with_settings({"n": 5, "steps": 40}))
    drawn: list[float] = []

    def tell(doing: str, share: float) -> None:
        if doing == "drawn":
            drawn.append(share)
            raise StoppedError

    show.take_steps(30)
    show.advance(30)
    with pytest.raises(StoppedError):
        show.export("gif")(tell)
    assert len(drawn) == 1
    assert show.export("png")(untold)["name"].endswith("-step-30.png")


class Slow(Live):
    """A show whose files are finished when nobody wants them any more; `begun` says
    that one is being made.
    """

    begun = threading.Event()

    def export(self, kind: str) -> Make:
        def make(tell: Tell) -> Reply:
            tell("drawn", 0.42)
            self.begun.set()
            while True:
                tell("drawn", 0.42)

        return make if kind == "gif" else super().export(kind)

    def beside(self, preset: str, /) -> Live:
        """One that is as slow, from its start."""
        return Slow(super().beside(preset).state)


def test_a_page_shows_how_far_a_file_is_and_stops_it(
    opened: Open, tmp_path: Path
) -> None:
    with running_server(lambda: Slow(in_the_cafeteria().state)) as server:
        page = opened(server)
        item(page, "GIF").click()
        making = page.page.locator(".making")
        making.get_by_text("GIF: drawn, 42 %").wait_for()
        assert Slow.begun.is_set()
        making.get_by_role("button", name="Stop").click()
        making.wait_for(state="hidden")
        name, _ = exported(page, "this frame as pixels", tmp_path)
        assert name.endswith("-step-0.png")


def test_what_goes_wrong_with_a_file_stays_until_it_is_closed(opened: Open) -> None:
    page = opened()
    page.send(type="export", kind="exe")
    toast = page.page.locator(".toast")
    toast.get_by_text('unknown kind of file "exe"').wait_for()
    assert toast.get_attribute("role") == "alert"
    toast.get_by_role("button", name="Close").click()
    assert toast.count() == 0
