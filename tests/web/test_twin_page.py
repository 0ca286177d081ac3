"""What a user does with the past, with edits, and with two runs, in a real browser."""

import json
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from sweep.web.live_show import Live
from sweep.web.replaying import Replay
from sweep.web.server import PageServer
from sweep.web.twin import Twin
from tests.studies import SMALL, launched
from tests.web.chromium import (
    Opened,
    in_a_thread,
    in_the_cafeteria,
    running_server,
)
from tests.web.test_exports import Slow
from tests.web.test_going_on import free_port

Open = Callable[..., Opened]
WATCH = """() => {
  const { view, second } = boidsweep;
  const { taken } = second.stage;
  window.drawn = [];
  const note = () => {
    window.drawn.push([view, second].map(({ stage }) => stage.frame.step));
    window.drawn.at(-1).push(view.run.step);
  };
  second.stage.taken = (frame) => {
    taken(frame);
    setTimeout(note);
  };
}"""
"""Notes the steps of both pictures, and of the clock, after each time they were
drawn: a browser shows nothing before.
"""


def pair(page: Opened) -> Twin:
    show = page.show
    assert isinstance(show, Twin)
    return show


def test_two_presets_run_side_by_side_on_one_clock(opened: Open) -> None:
    page = opened(locale="en")  # of its own, as it shows two runs
    tab = page.page
    tab.locator("summary", has_text="as_written").click()
    tab.get_by_role("button", name="Show as_written next to this run").click()
    page.until("boidsweep.second?.stage.frame")
    page.ask(WATCH)
    heads = tab.locator(".head-of-side")
    assert [heads.nth(i).locator(".name").inner_text() for i in range(2)] == [
        "aziel_chen2025, as_run",
        "aziel_chen2025, as_written",
    ]
    first, second = (heads.nth(i).locator(".differing").inner_text() for i in range(2))
    assert first != second
    assert tab.locator(".run:visible").count() == 1
    tab.locator(".run .going").click()
    page.until("drawn.length > 5")
    tab.locator(".run select").select_option("0")
    page.until("boidsweep.view.stage.frame.step > 60")
    tab.locator(".side").nth(1).locator("canvas").first.focus()
    tab.keyboard.press("Space")  # in the second one, for both
    page.until("!boidsweep.view.state.running && !boidsweep.second.state.running")
    tab.get_by_label("step", exact=True).fill("20")
    page.until("boidsweep.view.stage.frame.step === 20")
    tab.keyboard.press(".")
    page.until("boidsweep.second.stage.frame.step === 21")
    drawn = page.ask("drawn")
    assert len(drawn) > 6
    assert all(one == other == clock for one, other, clock in drawn)
    name = page.ask("[...boidsweep.view.charts.plots.keys()][0]")
    mine, theirs = (
        page.ask(f"boidsweep.{side}.charts.plots.get('{name}').bounds()")
        for side in ("view", "second")
    )
    assert mine == theirs
    label = "document.querySelector('.differences .plot canvas').ariaLabel"
    page.until(f"{label}.endsWith('at step 21')")  # drawn some times a second
    shown = page.ask(label)
    one, other = (
        page.ask(f"boidsweep.{side}.charts.seriesOf('{name}').at(21)")
        for side in ("view", "second")
    )
    assert f"{float(f'{other - one:.4g}'):g}"[:6] in shown
    tab.locator(".side").nth(1).get_by_label("n", exact=True).fill("17")
    tab.locator(".side").nth(1).get_by_label("n", exact=True).press("Enter")
    page.until("boidsweep.second.stage.frame.n === 17")
    page.until("boidsweep.view.stage.frame.step === 0")
    assert "n 17" in heads.nth(1).inner_text()
    kept = pair(page).sides[1]
    tab.get_by_role("button", name="Only B").click()
    page.until("!boidsweep.second && boidsweep.view.state.preset === 'as_written'")
    assert page.show is kept
    assert tab.locator("canvas[role=application]").count() == 1
    assert tab.locator(".run:visible").count() == 1


def test_a_page_that_comes_back_shows_both_runs_again(opened: Open) -> None:
    page = opened(locale="en")
    page.page.get_by_role("button", name="Show this run twice").click()
    page.until("boidsweep.second?.stage.frame")
    page.send(type="step", count=9)
    page.until("boidsweep.second.stage.frame.step === 9")
    page.page.reload()
    page.until("boidsweep.second?.stage.frame?.step === 9")
    assert page.ask("boidsweep.view.stage.frame.step") == 9
    page.ask("boidsweep.second.before = true, boidsweep.socket.socket.close()")
    page.until("boidsweep.second && !boidsweep.second.before")
    page.until("boidsweep.second.stage.frame?.step === 9")
    assert page.page.locator(".side").count() == 2


def test_both_runs_are_restored_by_a_server_that_is_started_anew(opened: Open) -> None:
    port = free_port()
    with ExitStack() as first:
        server = PageServer(in_the_cafeteria, port)
        page = opened(first.enter_context(in_a_thread(server)))
        page.page.locator("summary", has_text="as_written").click()
        page.page.get_by_role("button", name="Show as_written next to").click()
        page.until("boidsweep.second?.state")
        page.send(type="set", name="n", value=17, side=1)
        kept = "boidsweep.view.memory.read()"
        page.until(f"{kept}?.yaml_beside?.includes('n: 17')")
        assert "n: 17" not in page.ask(f"{kept}.yaml")
        address = page.ask("boidsweep.view.memory.address(boidsweep.view.viewed)")
        page.until("!boidsweep.second.asked")
        before = page.ask("[boidsweep.view.state, boidsweep.second.state]")
    page.until("boidsweep.view.away && boidsweep.second.away")
    with in_a_thread(PageServer(in_the_cafeteria, port)) as server:
        page.until("!boidsweep.view.away && boidsweep.second?.state")
        after = page.ask("[boidsweep.view.state, boidsweep.second.state]")
        for one, other in zip(before, after, strict=True):
            assert one["settings"] == other["settings"]
        page.until(f"{kept}.yaml_beside")
        other = page.page.context.new_page()
        other.goto(address)
        other.wait_for_function(
            "() => window.boidsweep?.second?.state?.settings.n === 17"
        )
        page.page.get_by_role("button", name="Only A").click()
        page.until(f"!boidsweep.second && !{kept}.yaml_beside")
        page.page.context.close()
    # What the browser says of the server that was away.
    page.complaints[:] = [one for one in page.complaints if "WebSocket" not in one]


def test_the_progress_of_a_file_is_shown_beside_the_run_that_it_is_of(
    opened: Open,
) -> None:
    with running_server(lambda: Slow(in_the_cafeteria().state)) as server:
        page = opened(server)
        page.page.get_by_role("button", name="Show this run twice").click()
        page.until("boidsweep.second?.stage.frame")
        one, other = (
            page.page.locator(".side").nth(side).locator(".making") for side in (0, 1)
        )
        page.send(type="export", kind="gif", side=1)
        other.get_by_text("GIF: drawn, 42 %").wait_for()
        assert not one.is_visible()
        page.ask("boidsweep.view.files.ask('gif')")  # two at a time are refused
        page.page.get_by_text("another file is being made").wait_for()
        one.wait_for(state="hidden")
        assert other.is_visible()
        other.get_by_role("button", name="Stop").click()
        other.wait_for(state="hidden")


def test_two_stored_trials_are_played_side_by_side(
    opened: Open, tmp_path: Path
) -> None:
    study = launched(SMALL, tmp_path)
    trials = [str(study.trials["trial_id"][k]) for k in (0, 1)]
    shows = [Twin(*(Replay(study, trial) for trial in trials)) for _ in range(1)]
    with running_server(shows.pop) as server:
        page = opened(server)
        page.until("boidsweep.second?.stage.frame")
        last = page.ask("boidsweep.view.state.replay.frames[1]")
        page.page.get_by_label("step", exact=True).fill(str(last))
        page.until(f"boidsweep.second.stage.frame.step === {last}")
        names = page.page.locator(".head-of-side .name").all_inner_texts()
        assert all(study.name in name for name in names)
        assert names[0] != names[1]


def test_the_past_of_a_live_run_is_scrubbed_and_changed(opened: Open) -> None:
    page = opened()
    page.send(type="step", count=40)
    page.until("boidsweep.view.stage.frame.step === 40")
    show = page.show
    assert isinstance(show, Live)
    bodies = show.bodies.copy()
    scrub = page.page.get_by_label("step", exact=True)
    scrub.fill("10")
    page.until("boidsweep.view.stage.frame.step === 10")
    said = "40 steps were run. Run repeats the later steps with their changes"
    page.page.get_by_text(said).wait_for()
    assert (
        page.ask("boidsweep.view.charts.plots.values().next().value.span().last") == 40
    )
    scrub.fill("40")
    page.until("boidsweep.view.stage.frame.step === 40")
    np.testing.assert_array_equal(show.bodies, bodies)
    assert not page.page.get_by_text(said).is_visible()
    scrub.fill("10")
    page.until("boidsweep.view.stage.frame.step === 10")
    page.send(type="set", name="cohesion_weight", value=0.9)
    page.until("boidsweep.view.state.past[1] === 10 && !boidsweep.view.asked")
    page.until("boidsweep.view.charts.plots.values().next().value.span().last === 10")
    assert not page.page.get_by_text("steps were run").is_visible()


def test_a_stray_drag_edits_nothing_and_undo_gives_the_map_its_name_again(
    opened: Open,
) -> None:
    page = opened()
    x, y = page.ask("boidsweep.view.stage.obstacles[4].slice(0, 2)")
    camera = page.ask("boidsweep.view.stage.camera")
    page.drag((x, y), (x + 40, y))
    page.until("boidsweep.view.stage.camera.x !== " + str(camera["x"]))
    assert page.ask("[boidsweep.view.stage.edited, boidsweep.view.state.shapes]") == [
        None,
        None,
    ]
    page.page.mouse.click(*page.place(x, y))
    assert page.ask("boidsweep.view.stage.marked") == 4
    page.drag((x, y), (x + 40, y))
    page.until("boidsweep.view.state.shapes && !boidsweep.view.asked")
    page.until("boidsweep.view.state.settings.map === 'edited'")
    page.page.get_by_role("button", name="Undo obstacles").click()
    page.until("boidsweep.view.state.settings.map === 'cafeteria'")
    page.until(f"boidsweep.view.stage.obstacles[4][0] === {x}")
    assert page.page.get_by_label("map", exact=True).input_value() == "cafeteria"
    page.page.keyboard.press("Control+Shift+z")
    page.until("boidsweep.view.state.settings.map === 'edited'")
    page.page.keyboard.press("Control+z")
    page.until("boidsweep.view.state.settings.map === 'cafeteria'")


@pytest.mark.parametrize("steps", [1, 6])
def test_a_drag_of_a_slider_is_one_edit(opened: Open, steps: int) -> None:
    page = opened()
    slider = page.page.get_by_label("cohesion weight, slider")
    edits = page.show.edits  # type: ignore[attr-defined]
    before = [edit.text for edit in edits.past][-1:]
    page.until("!boidsweep.view.asked")
    said = page.ask("boidsweep.view.state.undo")
    at = page.ask("boidsweep.view.groups.fields.get('cohesion_weight').slider.value")
    slider.hover()  # which waits until the panel has found its place
    box = slider.bounding_box()
    assert box is not None
    here = box["x"] + 7 + (box["width"] - 14) * float(at) / 1000
    page.page.mouse.move(here, box["y"] + box["height"] / 2)
    page.page.mouse.down()
    page.page.mouse.move(here + 40, box["y"] + box["height"] / 2, steps=steps)
    page.page.mouse.up()
    page.until(f"boidsweep.view.state.undo !== {json.dumps(said)}")
    page.until("!boidsweep.view.asked")
    assert page.ask("boidsweep.view.state.undo").startswith("cohesion weight")
    assert [edit.text for edit in edits.past][:-1][-1:] == before


def test_two_runs_are_seen_at_400_percent(opened: Open) -> None:
    """A window of 1280 x 1024 pixels has 320 x 256 then."""
    page = opened(viewport={"width": 320, "height": 256})
    page.send(type="beside", preset="as_written")
    page.until("boidsweep.second?.stage.frame")
    pictures = page.page.locator(".twins .picture")
    for i in range(2):
        seen = pictures.nth(i).evaluate(
            """(picture) => {
              picture.scrollIntoView({ block: "start" });
              const { left, top, width } = picture.getBoundingClientRect();
              const there = document.elementFromPoint(left + width / 2, top + 60);
              return picture.contains(there);
            }"""
        )
        assert seen
    assert page.ask("document.querySelector('.twins').scrollWidth") <= 320
    page.page.context.close()
