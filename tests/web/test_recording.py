"""The page that plays a run from disk: what is in it, and that a real browser plays it,
with nothing but the file.
"""

import base64
import hashlib
import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import sweep.web.recording as recording
from kernels.identity import kernels_sha
from sweep.cli.replay_files import ReplayFiles, check, show
from sweep.errors import ChoiceError
from sweep.sharing.stranger import NO_LICENCE
from sweep.web.export import File
from sweep.web.flight import KeptFlight, fly
from sweep.web.live_show import Live
from sweep.web.replaying import AS_STORED
from sweep.web.state import ViewState
from tests.patience import PATIENCE
from tests.studies import SMALL, launched

STATE = ViewState(
    "nguyen2024",
    "as_run",
    seed=3,
    fixed={"n": 40, "steps": 60},
    plots=("speed", "polarization"),
)
STUDY = "some/study"
HEAD, BYTES_A_BOID = 32, 5


@pytest.fixture(scope="module")
def flight() -> KeptFlight:
    return fly(STUDY, STATE.job, STATE.plots)


@pytest.fixture(scope="module")
def file(flight: KeptFlight) -> File:
    return recording.recording_of(flight, Live(STATE).greeting(), STATE.as_text())


def data_of(page: bytes) -> dict[str, Any]:
    """What the script of the page reads."""
    found = re.search(
        r'<script type="application/json" id="data">(.*?)</script>',
        page.decode(),
        re.DOTALL,
    )
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


def content_of(page: bytes) -> dict[str, Any]:
    """The run in a page."""
    content: dict[str, Any] = data_of(page)["recording"]
    return content


def test_a_recording_has_every_frame_within_half_a_step_of_16_bits(
    file: File, flight: KeptFlight
) -> None:
    content = content_of(file.content)
    assert content["steps"] == list(range(61))
    size = HEAD + 40 * BYTES_A_BOID
    frames = base64.b64decode(content["frames"])
    assert len(frames) == 61 * size
    for step in (0, 17, 60):
        one = frames[step * size : (step + 1) * size]
        magic, flags, number, n, *box = struct.unpack("<4s3I4f", one[:HEAD])
        assert (magic, flags, number, n) == (b"BSF1", 0, step, 40)
        x, y = np.frombuffer(one[HEAD : HEAD + 160], "<u2").reshape(2, 40)
        for quantised, exact, low, high in (
            (x, 0, box[0], box[2]),
            (y, 1, box[1], box[3]),
        ):
            unit = (high - low) / 65535
            assert (
                np.abs(low + quantised * unit - flight.bodies[step, exact]).max()
                <= 0.51 * unit
            )


def test_a_recording_says_what_it_is_of(file: File, flight: KeptFlight) -> None:
    content = content_of(file.content)
    assert (
        file.name
        == f"some-study-{STATE.job.trial_id[:8]}-to-step-{flight.steps[-1]}.html"
    )
    assert content["about"]["Trial"] == STATE.job.trial_id
    assert content["about"]["kernels_sha"] == kernels_sha()
    assert content["spec"] == STATE.as_text()
    assert content["values"]["speed"] == flight.values["speed"].tolist()
    assert content["state"]["replay"]["frames"] == [0, 60, 1]
    assert content["state"]["replay"]["recorded"] is True
    assert (
        content["state"]["replay"]["words"]
        == "The spec gives these frames, bit for bit."
    )
    assert (content["state"]["step"], content["state"]["running"]) == (0, False)
    text = file.content.decode()
    assert "<title>nguyen2024, as_run, seed 3</title>" in text
    front = data_of(file.content)["front"]
    assert front["title"] == "nguyen2024, as_run, seed 3"
    assert front["caption"] == (
        "40 boids of the model nguyen2024, preset as_run, on the map random_obstacles:"
        " 60 steps, dt = 1 step."
    )
    assert [work.split(":")[0] for work in front["cite"]] == [
        "The boidsweep authors (2026)",
        "Q. C. Nguyen (2024), report, University at Buffalo, 17 December 2024",
        f"Trial {STATE.job.trial_id} of the study {STUDY}, kernels {kernels_sha()}.",
    ]
    assert front["licence"] == NO_LICENCE


def test_a_stored_trial_is_written_as_a_page_that_compares_it(tmp_path: Path) -> None:
    study, path = launched(SMALL, tmp_path), tmp_path / "flight.html"
    trial = str(study.trials["trial_id"][0])
    assert show(study, trial, ReplayFiles(animation=path, every=3)) == [path]
    content = content_of(path.read_bytes())
    assert content["steps"] == [0, 3, 6, 9]
    assert content["state"]["replay"]["trial"] == trial
    assert content["state"]["replay"]["words"] == AS_STORED


def test_a_page_of_too_many_boids_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study, wanted = (
        launched(SMALL, tmp_path),
        ReplayFiles(animation=tmp_path / "flight.html"),
    )
    trial = str(study.trials["trial_id"][0])
    check(study, trial, wanted)
    monkeypatch.setattr(
        recording, "MOST_BYTES", 5 * 4 * (HEAD + 12 * BYTES_A_BOID + 3) // 3
    )
    with pytest.raises(ChoiceError, match=r"12 boids take .* which are 4 frames"):
        check(study, trial, wanted)
    check(study, trial, wanted._replace(every=3))


def test_a_recording_may_load_nothing_and_run_its_own_script_only(file: File) -> None:
    """What the policy allows are the very texts in the page."""
    text = file.content.decode()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    assert policy[1].startswith("default-src &#x27;none&#x27;; ")
    for element in ("<style>(.*?)</style>", '<script type="module">(.*?)</script>'):
        found = re.findall(element, text, re.DOTALL)
        assert len(found) == 1
        assert (
            base64.b64encode(hashlib.sha256(found[0].encode()).digest()).decode()
            in policy[1]
        )
    assert "http" not in policy[1]
    elements = re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r'(src|href)="', elements)


def test_no_text_in_a_recording_becomes_an_element(flight: KeptFlight) -> None:
    evil = "</script><script>alert(1)</script>"
    greeting = Live(STATE).greeting()
    greeting[-1]["note"] = evil
    file = recording.recording_of(flight._replace(study=evil), greeting, evil)
    assert file.content.decode().count("<script") == 2
    assert b"<script>alert" not in file.content
    assert (
        content_of(file.content)["spec"]
        == content_of(file.content)["state"]["note"]
        == evil
    )


def test_a_long_run_is_thinned_and_an_overfull_one_refused(
    flight: KeptFlight, monkeypatch: pytest.MonkeyPatch
) -> None:
    greeting = Live(STATE).greeting()
    bytes_a_frame = 4 * (HEAD + 40 * BYTES_A_BOID + 3) // 3 + 1
    monkeypatch.setattr(recording, "FEWEST_FRAMES", 10)
    monkeypatch.setattr(recording, "MOST_BYTES", 25 * bytes_a_frame)
    content = content_of(recording.recording_of(flight, greeting, "").content)
    assert content["steps"] == list(range(0, 61, 3))
    assert len(content["values"]["speed"]) == 21
    assert content["state"]["replay"]["frames"] == [0, 60, 3]
    monkeypatch.setattr(recording, "MOST_BYTES", 9 * bytes_a_frame)
    with pytest.raises(
        ChoiceError, match=r"40 boids take 314 bytes per frame; .* which are 9 frames"
    ):
        recording.recording_of(flight, greeting, "")


def test_two_hundred_boids_and_five_hundred_frames_are_a_few_megabytes() -> None:
    state = ViewState(
        "nguyen2024", "as_run", fixed={"n": 200, "steps": 500}, plots=("speed",)
    )
    file = recording.recording_of(
        fly(STUDY, state.job, state.plots), Live(state).greeting(), ""
    )
    assert len(content_of(file.content)["steps"]) == 501
    assert len(file.content) < 2_000_000


@pytest.fixture
def played(browser: Browser, file: File, tmp_path: Path) -> Iterator[Page]:
    """The page, opened from disk; it asks for nothing else, and nothing goes wrong in
    it.
    """
    path = tmp_path / "run.html"
    path.write_bytes(file.content)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "console",
        lambda message: (
            wrong.append(message.text) if message.type in ("error", "warning") else None
        ),
    )
    page.on(
        "request",
        lambda request: (
            wrong.append(request.url) if request.url != path.as_uri() else None
        ),
    )
    page.goto(path.as_uri())
    yield page
    page.close()
    assert wrong == []


def clock(page: Page, words: str) -> None:
    """Wait until the page says which step it shows."""
    page.get_by_text(re.compile(words)).first.wait_for(timeout=1000 * PATIENCE)


def test_a_browser_plays_a_recording_from_disk_to_its_end(played: Page) -> None:
    clock(played, r"step 0 of 60")
    played.get_by_role("button", name=re.compile("^Run")).click()
    clock(played, r"step 60 of 60")
    played.get_by_role("button", name=re.compile("^Run")).first.wait_for()
    assert STATE.job.trial_id in played.locator("main").inner_text()


def test_a_recording_is_scrubbed_stepped_and_reset(played: Page) -> None:
    clock(played, r"step 0 of 60")
    played.get_by_role("slider", name="step", exact=True).fill("44")
    clock(played, r"step 44 of 60")
    played.keyboard.press("Escape")
    played.locator("body").press(".")
    clock(played, r"step 45 of 60")
    played.locator("body").press("r")
    clock(played, r"step 0 of 60")


def test_a_recording_hands_out_its_spec(played: Page) -> None:
    clock(played, r"step 0 of 60")
    played.get_by_role("button", name="Copy as spec").click()
    box = played.get_by_role("dialog")
    box.wait_for()
    box.locator("textarea, pre").first.wait_for()
    shown = box.locator("textarea, pre").first.evaluate(
        "element => element.value ?? element.textContent"
    )
    assert shown.strip() == STATE.as_text().strip()


def test_nothing_in_a_recorded_page_is_dead(played: Page) -> None:
    """No control is disabled, and each does something."""
    clock(played, r"step 0 of 60")
    inputs = "button, select, input, textarea"
    assert played.locator(f":is({inputs}):disabled").count() == 0
    names = played.locator("main").get_by_role("combobox").all()
    assert [one.get_attribute("aria-label") for one in names] == ["speed"]
    shown = [one.get_attribute("aria-label") for one in played.locator("aside").all()]
    assert shown == ["about the run"]


def test_a_boid_that_is_clicked_shows_whom_it_sees(played: Page) -> None:
    clock(played, r"step 0 of 60")
    facts = played.get_by_label("selected boid", exact=True).locator("p")
    assert facts.inner_text() == "Click a boid to see its neighbours."
    played.get_by_label("index of the selected boid").fill("7")
    played.keyboard.press("Enter")
    words = re.compile(r"^at [-\d.]+, [-\d.]+ .*; \d+ neighbours? within ")
    assert words.match(facts.inner_text())
    at_first = facts.inner_text()
    played.get_by_role("slider", name="step", exact=True).fill("44")
    clock(played, r"step 44 of 60")
    assert words.match(facts.inner_text())
    assert facts.inner_text() != at_first
    played.keyboard.press("Escape")
    played.locator("canvas[role=application]").press("Escape")
    assert facts.inner_text() == "Click a boid to see its neighbours."


def test_flocks_and_visits_of_a_recording_are_drawn(played: Page) -> None:
    clock(played, r"step 0 of 60")
    played.get_by_role("slider", name="step", exact=True).fill("44")
    played.get_by_label("flocks", exact=True).check()
    played.get_by_label("coverage", exact=True).check()
    played.get_by_text(re.compile(r"or more boids; grey boids are alone")).wait_for()
    played.get_by_text(re.compile(r"^0 to 100 % of a cell was visited")).wait_for()


def test_a_recorded_page_says_how_to_cite_it_and_its_settings(played: Page) -> None:
    clock(played, r"step 0 of 60")
    text = played.locator("main").inner_text()
    for words in (
        "How to cite",
        "Licence",
        "Q. C. Nguyen (2024), report, University at Buffalo, 17 December 2024",
        NO_LICENCE,
    ):
        assert words in text
    assert played.locator("h1").inner_text() == "nguyen2024, as_run, seed 3"
    played.get_by_text("parameters", exact=True).click()
    changed = played.locator(".values .changed").all_inner_texts()
    assert [one.split() for one in changed] == [["n", "40"], ["steps", "60"]]


def test_an_embedded_recording_is_the_picture_and_its_bar(
    browser: Browser, file: File, tmp_path: Path
) -> None:
    path = tmp_path / "run.html"
    path.write_bytes(file.content)
    page = browser.new_page(viewport={"width": 600, "height": 400})
    page.goto(path.as_uri() + "?embed")
    clock(page, r"step 0 of 60")
    assert page.locator(".front, details").count() == 0
    assert not page.get_by_label("about the run").is_visible()
    sides = page.locator(".player").bounding_box()
    assert sides == {"x": 0, "y": 0, "width": 600, "height": 400}
    page.close()


@pytest.mark.parametrize("width", [390, 700, 1280, 1700])
def test_the_picture_of_a_recording_fills_its_page(
    browser: Browser, file: File, tmp_path: Path, width: int
) -> None:
    """It is as wide as the page on a phone, and the larger part of a screen."""
    path = tmp_path / "run.html"
    path.write_bytes(file.content)
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.goto(path.as_uri())
    clock(page, r"step 0 of 60")
    page_box = page.locator(".recorded").bounding_box()
    assert page_box
    assert page_box["width"] == width
    least = width - 34 if width <= 700 else width / 2
    for part in ("canvas[role=application]", ".run"):
        box = page.locator(part).bounding_box()
        assert box
        assert least <= box["width"] <= width
        assert box["height"] > 20
    page.close()


def test_a_printed_recording_is_light_and_whole(
    browser: Browser, file: File, tmp_path: Path
) -> None:
    """On paper nothing is dark or folded, and no button is left."""
    path = tmp_path / "run.html"
    path.write_bytes(file.content)
    page = browser.new_page(color_scheme="dark")
    page.goto(path.as_uri())
    clock(page, r"step 0 of 60")
    corner = """() => Array.from(document.querySelector("canvas[role=application]")
      .getContext("2d").getImageData(2, 2, 1, 1).data)"""
    assert max(page.evaluate(corner)[:3]) < 60
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    page.emulate_media(media="print")
    assert min(page.evaluate(corner)[:3]) > 200
    assert page.locator("details:not([open])").count() == 0
    buttons = page.get_by_role("button").all()
    assert [one.get_attribute("title") for one in buttons if one.is_visible()] == []
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert max(page.evaluate(corner)[:3]) < 60
    page.close()
