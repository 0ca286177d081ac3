"""The page in a real browser: what is done there happens to the flock, and what happens
is seen there.
"""

import asyncio
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, expect

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.errors import SpecError
from sweep.spec.settings import in_a_line, places_of, preset_settings, settings_of
from sweep.spec.study import parse_spec
from sweep.trial.simulation import simulate
from sweep.web.live_show import Live
from sweep.web.page import script
from sweep.web.protocol import Reply
from sweep.web.replaying import Replay
from sweep.web.server import Socket
from sweep.web.state import from_study
from tests import builders, oscillators, studies
from tests.patience import PATIENCE
from tests.web.chromium import Opened, running_server
from tests.web.test_axe import found

Open = Callable[..., Opened]
Bodies = NDArray[np.float64]


def live(page: Opened) -> Live:
    show = page.show
    assert isinstance(show, Live)
    return show


def go_to(page: Opened, step: int) -> Bodies:
    """Step to a step and return the bodies there."""
    page.send(type="step", count=step - live(page).step)
    page.until(
        f"boidsweep.view.state.step === {step} && boidsweep.view.stage.frame.step ==="
        f" {step}"
    )
    return live(page).bodies.copy()


def until_set(page: Opened, name: str, value: object) -> None:
    page.until(f"boidsweep.view.state.settings.{name} === {json.dumps(value)}")


def until_model(page: Opened, model: str) -> None:
    """Its controls come first, and then the settings that they show."""
    page.until(
        f"boidsweep.view.controls.model === '{model}' && boidsweep.view.state.model ==="
        f" '{model}'"
    )


def obstacles(page: Opened) -> list[list[float]]:
    """Those of the simulation: x, y, half width, half
    height, and whether it is a disc.
    """
    scene = live(page).scene()
    return list(scene["obstacles"])


def until_obstacles(page: Opened, count: int) -> list[list[float]]:
    page.until(
        f"boidsweep.view.stage.scene.obstacles.length === {count} &&"
        " !boidsweep.view.stage.edited"
    )
    return obstacles(page)


CHANGE_ALL = """async (wanted, patience) => {
  const { view } = boidsweep;
  const pause = () => new Promise((done) => setTimeout(done, 5));
  const until = async (what, name) => {
    const begun = performance.now();
    while (!what() && performance.now() - begun < patience) await pause();
    const said = view.status.words.textContent;
    if (!what()) throw new Error(`nothing came of ${name}: ${said}`);
  };
  for (const [name, field] of view.groups.fields) {
    if (name === "seed" || wanted !== (name === "next_goals")) continue;
    const { kind, choices } = field.about;
    const before = view.state.settings[name];
    if (kind === "bool") field.input.click();
    else {
      const number = field.slide ? field.slide.beside(before, 1) : 50;
      const choice = choices?.find((one) => one !== before);
      const others = { choice, places: "5 5; 6 8" };
      field.input.value = others[kind] ?? String(number);
      field.input.dispatchEvent(new Event("change", { bubbles: true }));
    }
    const other = () => view.state.settings[name] !== before;
    const changed = () => view.state.changed.includes(name);
    await until(() => other() && changed(), name);
    field.back.click();
    await until(() => !other() && !changed(), name);
  }
}"""
"""Each setting gets another value by its control, and goes back by the button beside
it: with `true` goals in turn, which a model must go to, else all others.
"""


def test_every_model_has_a_control_for_every_setting(opened: Open) -> None:
    page = opened()
    for model in reversed(list(MODELS)):
        page.page.get_by_label("model", exact=True).select_option(model)
        until_model(page, model)
        assert live(page).state.model == model
        assert set(page.ask("[...boidsweep.view.groups.fields.keys()]")) == set(
            settings_of(model, BUILT_IN)
        ) - {"map"} | {"seed"}


def test_every_control_acts_on_the_simulation_and_goes_back_to_its_preset(
    opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    page, change = opened(), Live.change
    met: dict[str, list[object]] = {}

    def noted(show: Live, changes: Mapping[str, object]) -> None:
        change(show, changes)
        for name in changes:
            met.setdefault(name, []).append(show.simulation.job.settings[name])

    monkeypatch.setattr(Live, "change", noted)
    for model, to_goals in (("nguyen2024", "false"), ("rustamani2024", "true")):
        met.clear()
        page.send(type="model", model=model, preset="as_run")
        until_model(page, model)
        page.ask(f"({CHANGE_ALL})({to_goals}, {1000 * PATIENCE})")
        usual = set(settings_of(model, BUILT_IN)) - {"map", "next_goals"}
        assert set(met) == ({"next_goals"} if to_goals == "true" else usual)
        preset = MODELS[model].preset_values("as_run")
        assert [
            name
            for name, values in met.items()
            if values[0] == preset[name] or values[-1] != preset[name]
        ] == []


def test_a_slider_by_keyboard_changes_the_flight_as_a_sweep_would(opened: Open) -> None:
    page = opened()
    usual = go_to(page, 30)
    page.page.get_by_label("cohesion weight, slider").focus()
    page.page.keyboard.press("ArrowRight")
    page.until("boidsweep.view.state.settings.cohesion_weight > 0.213")
    page.until("!boidsweep.view.state.exact")
    page.page.keyboard.press("r")
    page.until("boidsweep.view.state.exact && boidsweep.view.stage.frame.step === 0")
    other = go_to(page, 30)
    assert not np.array_equal(usual, other)
    trajectory = simulate(live(page).state.job).trajectory
    assert trajectory is not None
    assert np.array_equal(trajectory[30], other)


def test_keys_run_pause_step_and_reset(opened: Open) -> None:
    page = opened()
    for _ in range(3):
        page.page.keyboard.press(".")
    page.until("boidsweep.view.stage.frame.step === 3")
    page.page.get_by_label("trails").check()
    # The switch was clicked: the key is meant for the run.
    page.page.keyboard.press("Space")
    page.until("boidsweep.view.state.running && boidsweep.view.stage.frame.step > 10")
    page.page.keyboard.press("Space")
    page.until("!boidsweep.view.state.running")
    assert page.page.get_by_label("trails").is_checked()
    assert not live(page).going
    page.page.keyboard.press("r")
    page.until("boidsweep.view.stage.frame.step === 0")
    page.page.keyboard.press("3")
    page.page.keyboard.press("+")
    page.until("boidsweep.view.state.settings.cohesion_weight > 0.213")
    page.page.keyboard.press("-")
    page.until("boidsweep.view.state.settings.cohesion_weight <= 0.213")


EARLY = """async ([presses, running]) => {
  const { RunBar } = await import("./run.js");
  const sent = [];
  const bar = new RunBar(({ type }) => sent.push(type));
  for (let press = 0; press < presses; press++) bar.toggle();
  bar.show({ ...boidsweep.view.state, running }, 0);
  bar.show({ ...boidsweep.view.state, running }, 1);
  return sent;
}"""


@pytest.mark.parametrize(
    ("presses", "running", "sent"),
    [(0, False, []), (1, False, ["run"]), (2, False, []), (1, True, [])],
)
def test_a_press_before_the_first_state_counts_once_it_is_there(
    opened: Open, presses: int, running: bool, sent: list[str]
) -> None:
    assert opened().page.evaluate(EARLY, [presses, running]) == sent


def test_a_run_that_has_ended_goes_on_for_twice_as_long(opened: Open) -> None:
    page = opened()
    page.send(type="set", name="steps", value=20)
    page.send(type="speed", steps_per_second=0)
    page.page.get_by_role("button", name="Run (Space)").click()
    page.page.get_by_role("button", name="Continue").wait_for()
    assert live(page).step == 20
    page.send(type="run")
    page.page.get_by_text("the run has ended after 20 steps").wait_for()
    page.until("!boidsweep.view.asked")
    assert page.page.locator("[aria-invalid]").count() == 0
    page.page.get_by_role("button", name="Continue").click()
    page.until("boidsweep.view.stage.frame.step === 40")
    assert live(page).state.settings["steps"] == 40


PIXELS = """(places) => {
  const { stage } = boidsweep.view;
  const context = stage.canvas.getContext("2d");
  const pixel = ([x, y]) => {
    const at = stage.toScreen({ x, y });
    const [column, row] = [Math.floor(at.x), Math.floor(at.y)];
    const colour = context.getImageData(column, row, 1, 1).data.slice(0, 3);
    return `rgb(${colour.join(", ")})`;
  };
  return [stage.colours.boid, places.map(pixel)];
}"""
"""The colour of boids, and that of the picture at some places."""


@pytest.mark.parametrize("n", [100, 1500])
def test_boids_are_drawn_where_they_are(opened: Open, n: int) -> None:
    """The pixels at their places have their colour, whether they are drawn as triangles
    or stamped.
    """
    page = opened()
    page.send(type="set", name="n", value=n)
    until_set(page, "n", n)
    page.until(f"boidsweep.view.stage.frame.n === {n}")
    bodies = go_to(page, 5)
    colour, pixels = page.page.evaluate(PIXELS, bodies[:2].T.tolist())
    assert pixels == [colour] * n


SHOWN = """(places) => {
  const { stage } = boidsweep.view;
  const wrong = new Set();
  const near = (a, b, most = 0.5) => Math.hypot(a[0] - b[0], a[1] - b[1]) < most;
  const of = (lines) => lines.stage.lines().parts
    .filter((one) => one.startsWith("<path") && one.split("L").length === 3)
    .map((one) => one.match(/[-\\d.]+/g).map(Number));
  const drawn = of({ stage });
  if (drawn.length !== places.length) wrong.add("the number of boids in the SVG");
  const png = stage.pixels(4).getContext("2d");
  places.forEach(([x, y], i) => {
    const at = stage.toScreen({ x, y });
    const here = [at.x, at.y];
    if (!near([stage.screenX[i], stage.screenY[i]], here)) wrong.add("the screen");
    if (!near(drawn[i] ?? [1e9, 1e9], here, 12)) wrong.add("the SVG");
    const [column, row] = [Math.floor(4 * at.x), Math.floor(4 * at.y)];
    const colour = png.getImageData(column, row, 1, 1).data;
    const words = `rgb(${Array.from(colour.slice(0, 3)).join(", ")})`;
    if (words !== stage.colours.boid) wrong.add("the PNG");
    const hit = stage.boidAt(at, 4);
    if (hit === null || !near(places[hit], [x, y], 4 / stage.camera.scale)) {
      wrong.add("the mouse");
    }
  });
  if (stage.trail.length !== 1) wrong.add("the trails");
  return [...wrong];
}"""
"""Where the page shows or hits boids elsewhere than where they are."""

IN_FRAME = """(places) => {
  const { n, box, x, y } = boidsweep.view.stage.frame;
  const at = (sixteen, low, high) => low + (sixteen / 65535) * (high - low);
  return n === places.length && places.every((place, i) =>
    Math.abs(at(x[i], box[0], box[2]) - place[0]) < 0.1 &&
    Math.abs(at(y[i], box[1], box[3]) - place[1]) < 0.1
  );
}"""
"""Whether the frame that has come has boids at these places."""

CHANGES_AT_THE_START: list[tuple[str, dict[str, object]]] = [
    ("the next trial", {"type": "trial", "point": 0, "replicate": 1}),
    ("the seed", {"type": "set", "name": "seed", "value": 77}),
    ("the map", {"type": "set", "name": "map", "value": "dense_cafeteria"}),
    ("how many boids", {"type": "set", "name": "n", "value": 31}),
    ("the preset", {"type": "model", "model": "nguyen2024", "preset": "as_written"}),
    ("the model", {"type": "model", "model": "aziel_chen2025", "preset": "as_run"}),
    (
        "an obstacle",
        {"type": "shapes", "shapes": [{"disc": {"x": 350, "y": 400, "radius": 120}}]},
    ),
    (
        "an obstacle that is moved",
        {"type": "shapes", "shapes": [{"disc": {"x": 450, "y": 400, "radius": 120}}]},
    ),
]
"""Messages by which boids start elsewhere."""


def test_after_each_change_at_the_start_boids_are_shown_where_they_are(
    opened: Open,
) -> None:
    """The picture is of the new run: on the screen, in files of it, for the mouse and
    for trails, which begin again.
    """
    study = parse_spec(
        "study: s\nmodel: nguyen2024\nfixed: {n: 30}\nreplicates: 3\n"
        "record: {metrics: [speed]}\n"
    )
    with running_server(lambda: Live(from_study(study))) as server:
        page = opened(server)
        before = live(page).bodies.copy()
        for name, message in CHANGES_AT_THE_START:
            page.send(**message)
            page.until("!boidsweep.view.asked")
            bodies = live(page).bodies
            assert live(page).step == 0
            assert not np.array_equal(bodies, before), name
            page.until(f"({IN_FRAME})({json.dumps(bodies[:2].T.tolist())})")
            assert page.page.evaluate(SHOWN, bodies[:2].T.tolist()) == [], name
            before = bodies.copy()


def test_obstacles_drawn_by_mouse_are_avoided_and_the_copied_spec_gives_the_same_frames(
    opened: Open, tmp_path: Path
) -> None:
    """Of those that start outside few come into the disc, and many cross its place
    where it is not.
    """
    page = opened()
    page.page.get_by_label("map", exact=True).select_option("empty")
    until_set(page, "map", "empty")
    page.send(type="set", name="steps", value=300)
    page.page.keyboard.press("d")
    page.drag((400, 300), (470, 300))
    ((x, y, radius, _, is_round),) = until_obstacles(page, 1)
    assert (round(x), round(y), round(radius), is_round) == (400, 300, 70, 1)
    page.send(type="speed", steps_per_second=0)
    page.page.keyboard.press("Space")
    page.until("boidsweep.view.stage.frame.step === 300")
    page.page.get_by_role("button", name="Copy as spec").click()
    page.page.get_by_text("A launch reproduces these frames").wait_for()
    text = page.page.get_by_label("spec.yaml").input_value()
    assert page.ask("navigator.clipboard.readText()") == text
    assert "disc: {x: 400" in text.replace(".0", "")
    study = studies.launched(text, tmp_path)
    _, flight = study.trajectory(study.trials["trial_id"][0])
    assert np.array_equal(flight[-1], live(page).bodies)
    empty = replace(live(page).state, own=None, fixed={"map": "empty", "steps": 300})
    free = simulate(empty.job).trajectory
    assert free is not None

    def come_in(frames: Bodies) -> int:
        inside = np.hypot(frames[:, 0] - x, frames[:, 1] - y) < radius
        return int((inside.any(axis=0) & ~inside[0]).sum())

    assert come_in(flight) * 5 < come_in(free)


def test_obstacles_are_moved_resized_removed_and_brought_back(opened: Open) -> None:
    page = opened()
    page.send(
        type="shapes",
        shapes=[{"rectangle": {"x": 300, "y": 300, "width": 100, "height": 60}}],
    )
    until_obstacles(page, 1)

    def now(row: list[float]) -> None:
        page.until(
            "boidsweep.view.stage.scene.obstacles[0]?.map(Math.round).join() ==="
            f" '{','.join(map(str, row))}'"
        )
        assert [round(value) for value in obstacles(page)[0]] == row

    page.page.keyboard.press("v")
    page.ask("boidsweep.view.hand.mark(0)")  # a boid may be there, too
    page.drag((300, 300), (500, 200))
    now([500, 200, 50, 30, 0])
    page.drag((550, 230), (600, 300))  # its corner, while the opposite one stays
    now([525, 235, 75, 65, 0])
    page.page.get_by_label("the swarm in a world").focus()
    page.page.keyboard.press("ArrowRight")
    now([533, 235, 75, 65, 0])
    page.page.keyboard.press("Shift+ArrowDown")
    now([533, 235, 75, 57, 0])
    page.page.keyboard.press("Delete")
    assert until_obstacles(page, 0) == []
    page.page.keyboard.press("Control+z")
    now([533, 235, 75, 57, 0])


HOLD_TIMERS = """() => {
  const usual = window.setTimeout;
  const due = [];
  window.setTimeout = (act) => due.push(act);
  window.ring = () => {
    window.setTimeout = usual;
    due.forEach((act) => act());
    return due.length;
  };
}"""
"""What timers would do is done by ring(), which says how many there were."""


def test_what_a_drag_still_had_to_say_is_not_said_in_the_next_one(opened: Open) -> None:
    """The world has answered meanwhile, and the next drag has changed nothing yet."""
    page = opened(locale="en")  # of its own, as its timers are held
    disc = {"x": 300, "y": 300, "radius": 50}
    page.send(type="shapes", shapes=[{"disc": disc}])
    until_obstacles(page, 1)
    page.ask("boidsweep.view.hand.mark(0)")  # a boid may be there, too
    page.ask(HOLD_TIMERS)
    page.drag((300, 300), (500, 200))
    page.until("!boidsweep.view.stage.edited && !boidsweep.view.asked")
    page.page.mouse.down()
    asked = page.ask("boidsweep.view.sent")
    assert page.ask("boidsweep.view.hand.drag.kind") == "shape"
    assert page.ask("ring()") > 0
    assert page.ask("boidsweep.view.sent") == asked
    page.page.mouse.up()
    page.until("!boidsweep.view.asked")
    assert [round(value) for value in obstacles(page)[0]] == [500, 200, 50, 50, 1]


def test_two_fingers_zoom_and_one_of_them_that_stays_does_nothing(opened: Open) -> None:
    page = opened(has_touch=True)
    touch = page.page.context.new_cdp_session(page.page)
    x, y = page.place(400, 300)

    def fingers(event: str, **along: float) -> None:
        """Something happens to these fingers, each so far beside the place."""
        ids = {"left": 0, "right": 1}
        points = [{"id": ids[name], "x": x + dx, "y": y} for name, dx in along.items()]
        touch.send("Input.dispatchTouchEvent", {"type": event, "touchPoints": points})

    before = page.ask("boidsweep.view.stage.camera.scale")
    fingers("touchStart", left=-50)
    fingers("touchStart", left=-50, right=50)
    fingers("touchMove", left=-100, right=100)
    page.until(f"boidsweep.view.stage.camera.scale > {1.9 * before}")
    camera = page.ask("boidsweep.view.stage.camera")
    fingers("touchEnd", right=100)
    page.until("boidsweep.view.hand.fingers.size === 1")
    fingers("touchMove", left=0)
    fingers("touchEnd")
    page.until("boidsweep.view.hand.fingers.size === 0")
    assert page.ask("[boidsweep.view.hand.drag, boidsweep.view.stage.camera]") == [
        None,
        camera,
    ]


def test_obstacles_without_a_mouse(opened: Open) -> None:
    """From the list: added, chosen, changed by its numbers, removed; those of a
    built-in map too.
    """
    page = opened()
    page.page.locator("summary", has_text="Obstacles").press("Enter")
    page.page.get_by_role("button", name="Add a disc in the middle").press("Enter")
    assert until_obstacles(page, 19)[-1][:2] == [400, 300]
    page.page.get_by_label("disc radius").fill("55")
    page.page.get_by_label("disc radius").press("Enter")
    page.until(
        "boidsweep.view.stage.scene.obstacles[18]?.[2] === 55 &&"
        " !boidsweep.view.stage.edited"
    )
    assert obstacles(page)[-1] == [400, 300, 55, 55, 1]
    page.page.get_by_role("button", name="Remove the disc at 400, 300").press("Enter")
    until_obstacles(page, 18)


def test_the_goal_is_set_by_mouse(opened: Open) -> None:
    page = opened()
    assert not page.page.get_by_role("button", name="Set the goal (G)").is_visible()
    page.send(type="set", name="goal_weight", value=0.001)
    page.until("boidsweep.view.stage.scene.goal")
    page.page.keyboard.press("g")
    page.page.mouse.click(*page.place(100, 500))
    page.until("boidsweep.view.state.settings.goal_x < 101")
    settings = live(page).simulation.world
    assert (round(settings.goal_x), round(settings.goal_y)) == (100, 500)
    page.drag((100, 500), (700, 100))
    page.until("boidsweep.view.state.settings.goal_x > 699")
    assert round(live(page).simulation.world.goal_y) == 100


SECOND, THIRD = (300.0, 40.0), (650.0, 560.0)


def goals(page: Opened) -> list[list[float]]:
    """The places of all goals of the run, in lengths of the world."""
    settings = live(page).state.settings
    later = places_of(settings["next_goals"]) or ()
    return [[settings["goal_x"], settings["goal_y"]], *map(list, later)]


def with_three_goals(opened: Open) -> Opened:
    """A page whose boids are not near the second and the third goal."""
    page = opened()
    page.send(type="set", name="goal_weight", value=0.001)
    page.send(type="set", name="next_goals", value=in_a_line((SECOND, THIRD)))
    page.until("boidsweep.view.stage.scene.next_goals.length === 2")
    for goal in (SECOND, THIRD):
        away = np.hypot(*(live(page).bodies[:2].T - goal).T)
        assert away.min() > 30
    return page


def test_each_of_several_goals_is_dragged(opened: Open) -> None:
    """Once it was clicked. A drag is one edit, and other goals stay where they are."""
    page = with_three_goals(opened)
    first = goals(page)[0]
    for index, start, end in ((2, THIRD, (500.0, 30.0)), (1, SECOND, (250.0, 570.0))):
        page.page.mouse.click(*page.place(*start))
        page.until(f"boidsweep.view.stage.goalMarked === {index}")
        before = goals(page)
        page.drag(start, end)
        page.until(
            f"Math.abs(boidsweep.view.stage.scene.next_goals[{index - 1}][1] -"
            f" {end[1]}) < 2 && !boidsweep.view.asked"
        )
        after = goals(page)
        assert after[index] == pytest.approx(end, abs=2)
        assert after[:index] + after[index + 1 :] == (
            before[:index] + before[index + 1 :]
        )
        page.until("boidsweep.view.state.undo")
        page.page.keyboard.press("Control+z")
        page.until(
            f"boidsweep.view.stage.scene.next_goals[{index - 1}][1] === {start[1]}"
        )
        assert goals(page) == [first, list(SECOND), list(THIRD)]
        page.until("boidsweep.view.state.redo")  # the state comes after the scene
        page.page.keyboard.press("Control+Shift+z")
        page.until(
            f"boidsweep.view.stage.scene.next_goals[{index - 1}][1] !== {start[1]}"
        )
        page.until("!boidsweep.view.state.redo && boidsweep.view.state.undo")
        page.page.keyboard.press("Control+z")
        page.until(
            f"boidsweep.view.stage.scene.next_goals[{index - 1}][1] === {start[1]}"
        )


def test_several_goals_are_moved_without_a_mouse(opened: Open) -> None:
    """G selects one after the other, and arrow keys move it by a hundredth of the
    world. The first comes after the last one again.
    """
    page = with_three_goals(opened)
    first = goals(page)[0]
    page.page.get_by_label("the swarm in a world").focus()
    met = []
    for _ in range(4):
        page.page.keyboard.press("g")
        met.append(page.ask("boidsweep.view.stage.goalMarked"))
    assert met == [0, 1, 2, 0]
    page.page.keyboard.press("g")
    page.page.keyboard.press("g")
    page.page.keyboard.press("ArrowLeft")
    page.until("boidsweep.view.state.settings.next_goals.includes('642 ')")
    assert goals(page) == [first, list(SECOND), [642.0, THIRD[1]]]
    page.page.keyboard.press("Escape")
    page.until("boidsweep.view.stage.goalMarked === null")


def test_a_boid_that_is_clicked_shows_whom_it_sees(opened: Open) -> None:
    page = opened()
    bodies = go_to(page, 3)
    page.page.mouse.click(*page.place(*bodies[:2, 17]))
    page.until("boidsweep.view.stage.selection?.boid === 17")
    selection = live(page).selection()
    assert selection["boid"] == 17
    assert (
        page.ask("boidsweep.view.stage.selection.neighbours") == selection["neighbours"]
    )
    page.page.keyboard.press("]")
    page.until("boidsweep.view.stage.selection?.boid === 18")
    assert page.page.get_by_label("index of the selected boid").input_value() == "18"
    page.page.get_by_label("index of the selected boid").fill("40")
    page.page.get_by_label("index of the selected boid").press("Enter")
    page.until("boidsweep.view.stage.selection?.boid === 40")
    page.page.get_by_label("Select no boid").click()
    page.until("boidsweep.view.stage.selection === null")
    assert live(page).selected is None


COLOURS = """() => {
  const { stage } = boidsweep.view;
  const { width, height } = stage.canvas;
  const { data } = stage.context.getImageData(0, 0, width, height);
  return new Set(new Uint32Array(data.buffer)).size;
}"""


def test_overlays_are_drawn_and_explained(opened: Open) -> None:
    page = opened()
    for step in (10, 20, 30, 40):
        go_to(page, step)  # trails join the frames that came
    there = {
        "trails": "trail",
        "flocks": "frame.flocks",
        "coverage": "coverage",
        "accelerations": "frame.accelerations",
    }
    for overlay, section in there.items():
        plain = page.ask(COLOURS)
        switch = page.page.get_by_label(overlay, exact=True)
        switch.check()
        page.until(
            f"boidsweep.view.stage.overlays.has('{overlay}') &&"
            f" boidsweep.view.stage.{section}"
        )
        page.until(f"({COLOURS})() > {plain} + 3")
        if overlay != "trails":
            assert live(page).overlays == (overlay,)
            legend = f"boidsweep.view.overlays.legends.get('{overlay}')"
            page.until(f"{legend}.textContent.length > 5")
        switch.uncheck()
        page.until(
            f"!boidsweep.view.stage.overlays.has('{overlay}') && ({COLOURS})() ==="
            f" {plain}"
        )


LOADING = """() => {
  const { stage } = boidsweep.view;
  const { scene } = stage;
  stage.scene = null;
  stage.draw();
  const corner = [...stage.context.getImageData(2, 2, 1, 1).data].slice(0, 3);
  const { width, height } = stage.canvas;
  const { data } = stage.context.getImageData(0, 0, width, height);
  stage.scene = scene;
  stage.redraw();
  const known = stage.colours.stage.match(/\\d+/g).map(Number);
  return [corner, known, new Set(new Uint32Array(data.buffer)).size];
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_picture_that_loads_says_so_on_its_ground(opened: Open, scheme: str) -> None:
    corner, ground, colours = opened(color_scheme=scheme).ask(f"({LOADING})()")
    assert corner == ground[:3]
    assert colours > 2  # of letters


HEADINGS = """async () => {
  const { WHEEL } = await import("./headings.js");
  const { stage } = boidsweep.view;
  const { heading, n } = stage.frame;
  const svg = stage.lines().document("", "");
  const drawn = Array.from({ length: n }, (_, i) => WHEEL[heading[i]]);
  const { ground, stage: around } = stage.colours;
  const grounds = [ground, around];
  return { WHEEL, drawn, svg, heading: [...heading].slice(0, n), grounds };
}"""


def luminance(colour: str) -> float:
    """The relative luminance of rgb(...), by WCAG 2.2."""
    parts = [int(part) / 255 for part in re.findall(r"\d+", colour)[:3]]
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4
        for part in parts
    ]
    return float(np.dot([0.2126, 0.7152, 0.0722], linear))


def contrast(one: str, other: str) -> float:
    """From 1 to 21, by WCAG 2.2."""
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_headings_are_colours_that_a_wheel_tells(opened: Open, scheme: str) -> None:
    """Each boid has the colour of its heading, which stands out on either ground. The
    number below the wheel is the polarization, up to headings of 256 steps.
    """
    page = opened(color_scheme=scheme)
    go_to(page, 40)
    page.page.get_by_label("headings", exact=True).check()
    page.until("boidsweep.view.stage.overlays.has('headings')")
    found = page.ask(f"({HEADINGS})()")
    assert len(set(found["WHEEL"])) > 200
    ends = zip(found["WHEEL"], found["WHEEL"][1:] + found["WHEEL"][:1], strict=True)
    for one, other in ends:
        assert abs(luminance(one) - luminance(other)) < 0.02
    least = min(
        contrast(one, ground) for one in found["WHEEL"] for ground in found["grounds"]
    )
    assert least >= 3.0  # WCAG 2.2, 1.4.11
    fills = re.findall(r'<path [^>]*fill="(rgb[^"]*)"', found["svg"])
    assert [one for one in fills if one in found["WHEEL"]] == found["drawn"]
    angles = 2 * np.pi * np.array(found["heading"]) / 256
    polarization = float(np.abs(np.exp(1j * angles).mean()))
    (text,) = re.findall(r"<text [^>]*>([\d.]+)</text>", found["svg"])
    assert float(text) == pytest.approx(polarization, rel=0.05)
    assert live(page).overlays == ()
    told = "boidsweep.view.overlays.legends.get('headings').textContent"
    page.until(f"{told}.includes('wheel')")


@pytest.mark.parametrize("n", [20, 1500])
def test_kinds_of_boids_have_colours_of_their_own_and_a_legend(
    opened: Open, n: int
) -> None:
    """Drawn as triangles or stamped; a model without kinds looks as ever."""
    page = opened()
    legend = "boidsweep.view.overlays.legends.get('kinds')"
    assert page.ask(f"{legend}.hidden && {legend}.textContent === ''")
    with builders.entered(oscillators.MODEL, order=oscillators.ORDER):
        page.send(type="model", model="oscillators", preset="as_run")
        until_model(page, "oscillators")
        page.send(type="set", name="n", value=n)
        until_set(page, "n", n)
        page.until(f"boidsweep.view.stage.frame.n === {n}")
        page.send(type="set", name="pacemakers", value=n // 2)
        until_set(page, "pacemakers", n // 2)
        bodies = go_to(page, 5)
        _, pixels = page.page.evaluate(PIXELS, bodies[:2].T.tolist())
        kinds = page.ask("boidsweep.view.stage.hues.slice(0, 2)")
        wanted = [kinds[0]] * (n // 2) + [kinds[1]] * (n - n // 2)
        same = sum(one == other for one, other in zip(pixels, wanted, strict=True))
        # A boid may lie on another one.
        assert same > 0.8 * n
        assert set(pixels) <= set(kinds)
        page.until(
            f"{legend}.textContent === '{n // 2} pacemaker{n - n // 2} follower'"
        )
        page.page.get_by_label("flocks", exact=True).check()
        page.until(f"{legend}.hidden")
        page.page.get_by_label("flocks", exact=True).uncheck()
        page.until(f"!{legend}.hidden")
        page.send(type="model", model="nguyen2024", preset="as_run")
        until_model(page, "nguyen2024")
        page.until(f"{legend}.hidden && boidsweep.view.stage.kinds === null")


def test_metrics_are_plotted_as_they_are_measured_and_chosen_from_a_list(
    opened: Open,
) -> None:
    page = opened()
    page.page.get_by_role("button", name="Choose metrics").click()
    page.page.get_by_role("checkbox", name="escapes").uncheck()
    page.page.get_by_role("checkbox", name="polarization").check()
    page.page.keyboard.press("Escape")
    page.until(
        "boidsweep.view.state.plots.includes('polarization') &&"
        " !boidsweep.view.state.plots.includes('escapes')"
    )
    go_to(page, 25)
    plotted = "boidsweep.view.charts.plots.get('polarization').series"
    page.until(f"{plotted}.steps.length === 26")
    rows = live(page).history.rows
    values = [row.values["polarization"] for row in rows]
    assert page.ask(f"{plotted}.values") == values
    assert page.page.get_by_role("img", name="polarization: ").count() == 1
    page.page.get_by_role("button", name="Remove the plot of polarization").click()
    page.until("!boidsweep.view.state.plots.includes('polarization')")


def test_settings_and_metrics_are_searched(opened: Open) -> None:
    page = opened()
    root = page.page
    rows = root.locator(".group [data-name]")
    opened_before = root.locator(".group[open]").count()
    field = root.get_by_label("Search settings")
    field.fill("Separation_weight")
    expect(rows.locator("visible=true")).to_have_count(1)
    expect(root.locator("[data-name=separation_weight]")).to_be_visible()
    assert found(root) == []
    page.ask("boidsweep.view.groups.offer(boidsweep.view.controls)")  # anew
    expect(rows.locator("visible=true")).to_have_count(1)
    field.fill("no such words")
    expect(rows.locator("visible=true")).to_have_count(0)
    expect(root.get_by_text('nothing has "no such words"')).to_be_visible()
    field.fill("")
    assert root.locator(".group[open]").count() == opened_before
    expect(root.locator("[data-name=separation_weight]")).to_be_visible()
    root.get_by_role("button", name="Choose metrics").click()
    root.get_by_label("Search metrics").fill("polarization")
    labels = root.locator("dialog[open] .choices label").locator("visible=true")
    texts = labels.all_inner_texts()
    assert texts
    assert all("polarization" in text.lower() for text in texts)
    assert found(root) == []


def test_a_run_goes_on_when_its_last_plot_is_removed(opened: Open) -> None:
    page = opened()
    plots = page.page.locator(".plots .plot")
    removing = page.page.get_by_role("button", name=re.compile("^Remove"))
    while count := plots.count():
        removing.first.click()
        page.until(f"boidsweep.view.state.plots.length === {count - 1}")
        page.until(f"document.querySelectorAll('.plots .plot').length === {count - 1}")
    page.page.get_by_role("button", name="Run (Space)").click()
    page.until("boidsweep.view.stage.frame.step > 5")
    page.send(type="pause")
    assert page.page.locator(".banner").is_hidden()
    page.send(type="metrics", names=["speed"])
    page.until("boidsweep.view.charts.plots.has('speed')")
    assert live(page).exact


def test_what_presets_differ_in_is_listed_with_a_switch_for_each(
    opened: Open,
) -> None:
    """All switches make the other preset; what was changed stays in another preset."""
    page = opened()
    page.send(type="model", model="nguyen2024", preset="as_run")
    until_model(page, "nguyen2024")
    page.page.get_by_text("against as_written").click()
    usual = preset_settings("nguyen2024", "as_run", BUILT_IN)
    other = preset_settings("nguyen2024", "as_written", BUILT_IN)
    differ = {name for name in usual if usual[name] != other[name]}
    switches = page.page.locator(".presets .switch")
    assert differ
    assert switches.count() == len(differ)
    for place in range(switches.count()):
        switches.nth(place).click()
        page.until("!boidsweep.view.asked")
        assert switches.nth(place).is_checked()
    assert live(page).state.settings == other
    assert set(live(page).state.fixed) == differ
    switches.first.click()
    page.until("!boidsweep.view.asked")
    assert len(live(page).state.fixed) == len(differ) - 1
    page.send(type="model", model="nguyen2024", preset="as_run")
    page.until("!boidsweep.view.asked")
    page.send(type="set", name="n", value=77)
    page.page.get_by_label("preset", exact=True).select_option("as_written")
    page.until("boidsweep.view.state.preset === 'as_written'")
    assert live(page).state.settings == other | {"n": 77}


def test_published_values_stand_beside_the_plots_of_the_very_settings(
    opened: Open,
) -> None:
    """Any other setting makes them those of another run, which is said."""
    page = opened()
    page.send(type="model", model="nguyen2024", preset="as_run")
    speed = "boidsweep.view.charts.plots.get('speed')"
    for name, value in (("separation_weight", 0.7), ("max_force", 5)):
        page.until(f"{speed}?.published.length > 0")
        usual = page.ask("boidsweep.view.state.settings")[name]
        assert "published: 0.765 at step 0" in page.ask(f"{speed}.line.textContent")
        page.send(type="set", name=name, value=value)
        page.until(f"{speed}.published.length === 0")
        assert page.ask(f"{speed}.line.textContent") == (
            "0.765 at step 0 is published for other parameters: "
            + name.replace("_", " ")
        )
        page.send(type="set", name=name, value=usual)
    page.until(f"{speed}.published.length > 0")
    go_to(page, 2)
    page.send(type="set", name="max_force", value=5)
    go_to(page, 3)
    page.send(type="set", name="max_force", value=0.5)
    page.until("!boidsweep.view.asked && !boidsweep.view.state.exact")
    assert page.ask(f"{speed}.published") == []
    assert "a run without changes of" in page.ask(f"{speed}.line.textContent")


def test_a_setting_marked_to_be_swept_is_an_axis_of_the_copied_spec(
    opened: Open,
) -> None:
    page = opened()
    page.page.get_by_role("button", name="Sweep fov in the copied spec").click()
    page.page.get_by_label("fov, sweep: low").fill("60")
    page.page.get_by_label("fov, sweep: low").press("Enter")
    page.until("boidsweep.view.state.sweeps.fov?.low === 60")
    page.page.get_by_label("fov, sweep: points").fill("4")
    page.page.get_by_label("fov, sweep: points").press("Enter")
    page.until("boidsweep.view.state.sweeps.fov?.points === 4")
    sweeps = page.ask("boidsweep.view.state.sweeps")
    page.page.get_by_role("button", name="Copy as spec").click()
    page.page.get_by_text("Without the sweep").wait_for()
    spec = parse_spec(page.page.get_by_label("spec.yaml").input_value())
    points = expand(spec)
    found = [points.settings(i)["fov"] for i in range(points.n_points)]
    low, high = (sweeps["fov"][end] for end in ("low", "high"))
    assert low == 60
    assert found == np.linspace(low, high, 4).tolist()


def test_the_copied_spec_has_the_name_and_the_replicates_that_are_wanted(
    opened: Open,
) -> None:
    page = opened()
    page.page.get_by_role("button", name="Copy as spec").click()
    page.page.get_by_text("A launch reproduces these frames").wait_for()
    text = page.page.get_by_label("spec.yaml")
    before = parse_spec(text.input_value())
    box = page.page.get_by_role("dialog")
    name = box.get_by_label("study", exact=True)
    replicates = box.get_by_label("replicates", exact=True)
    assert name.input_value() == before.name
    assert replicates.input_value() == "1"
    name.fill("my/cafeteria")
    name.press("Enter")
    replicates.fill("12")
    replicates.press("Enter")
    page.until(
        "navigator.clipboard.readText().then((text) => text.includes('replicates: 12'))"
    )
    after = parse_spec(text.input_value())
    assert (after.name, after.replicates) == ("my/cafeteria", 12)
    assert page.ask("navigator.clipboard.readText()") == text.input_value()
    ids = [expand(study).base for study in (before, after)]
    assert ids[0] == ids[1]
    # What is not allowed is not written; a number stays a name, and can be changed.
    for given, then in (("", "my/cafeteria"), ("a name", "my/cafeteria"), ("7", "7")):
        name.fill(given)
        name.press("Enter")
        page.until(f"document.activeElement.value === '{then}'")
        assert parse_spec(text.input_value()).name == then
    name.fill("mine")
    name.press("Enter")
    page.until("document.querySelector('dialog textarea').value.includes('mine')")
    assert parse_spec(text.input_value()).name == "mine"
    replicates.fill("1e3")
    replicates.press("Enter")
    page.page.get_by_text("an integer from 1").wait_for()
    assert parse_spec(text.input_value()).replicates == 12


def test_a_map_a_preset_and_a_seed_are_picked(opened: Open) -> None:
    page = opened()
    page.page.get_by_label("map", exact=True).select_option("narrow_corridor")
    page.until("boidsweep.view.stage.scene.obstacles.length === 2")
    page.page.get_by_label("preset", exact=True).select_option("as_written")
    page.until("boidsweep.view.state.preset === 'as_written'")
    page.page.get_by_label("seed", exact=True).fill("77")
    page.page.get_by_label("seed", exact=True).press("Enter")
    page.until("boidsweep.view.state.seed === 77")
    assert (live(page).state.preset, live(page).state.seed) == ("as_written", 77)


def test_what_is_wrong_is_said_in_words_and_is_never_read_as_html(opened: Open) -> None:
    page = opened()
    setting = page.page.get_by_label("separation weight", exact=True)
    setting.fill("-3")
    setting.press("Enter")
    page.page.get_by_text("-3 is not allowed for separation_weight").wait_for()
    assert setting.get_attribute("aria-invalid") == "true"
    other = page.page.get_by_label("alignment weight", exact=True)
    other.fill("much")
    other.press("Enter")
    page.page.get_by_text(
        "'much' is not allowed for alignment_weight; allowed: a number"
    ).wait_for()
    page.until("!boidsweep.view.asked")
    assert page.ask("document.querySelectorAll('[aria-invalid]').length") == 2
    page.send(type="set", name="fov", value=200)
    page.until("document.querySelectorAll('[aria-invalid]').length === 0")
    assert page.ask("boidsweep.view.status.words.textContent") == ""
    page.send(type="set", name="fov", value=150)
    for text in (
        '{"type": "set", "name": "<img src=x onerror=alert(1)>", "value": 1}',
        "{",
        "[]",
        '{"type": "jump"}',
    ):
        page.page.evaluate("text => boidsweep.socket.socket.send(text)", text)
    page.page.get_by_text('unknown message "jump"').wait_for()
    assert page.ask("document.querySelectorAll('img').length") == 0
    assert np.isfinite(go_to(page, 4)).all()
    assert live(page).exact


NUDGES = """async () => {
  const field = boidsweep.view.groups.fields.get("cohesion_weight");
  const seen = [];
  const pause = () => new Promise((done) => setTimeout(done, 10));
  for (let i = 0; i < 8; i++) {
    field.step(1);
    for (let k = 0; k < 8; k++) {
      seen.push(Number(field.input.value));
      await pause();
    }
  }
  return seen;
}"""


def test_on_a_slow_line_controls_show_what_was_asked_last(
    opened: Open, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And never what an older answer says."""
    tell = Socket.tell

    async def late(line: Socket, reply: Reply) -> None:
        await asyncio.sleep(0.1)
        await tell(line, reply)

    page = opened()
    monkeypatch.setattr(Socket, "tell", late)
    seen = page.ask(NUDGES)
    assert len(set(seen)) == 8
    assert seen == sorted(seen)
    until_set(page, "cohesion_weight", seen[-1])
    page.page.keyboard.press("Space")
    page.page.keyboard.press("Space")
    for _ in range(3):
        page.page.keyboard.press("]")
    page.until("!boidsweep.view.asked")
    assert not live(page).running
    assert live(page).selected == 2


def test_a_page_that_gets_no_run_says_why(browser: Browser) -> None:
    def none() -> Live:
        raise SpecError("there is nothing to see")

    complaints: list[str] = []
    with running_server(none) as server:
        page = browser.new_page()
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.goto(server.url)
        page.get_by_text("there is nothing to see").wait_for()
        page.get_by_text("The server has no run for this page.").wait_for()
        page.close()
    assert complaints == []


def test_a_page_comes_back_to_its_session(opened: Open) -> None:
    """A socket is dropped in the middle: the run stands still meanwhile, and goes on
    where it was.
    """
    page = opened()
    page.send(type="set", name="cohesion_weight", value=0.1)
    until_set(page, "cohesion_weight", 0.1)
    go_to(page, 12)
    show = page.show
    page.ask("boidsweep.socket.socket.close()")
    page.page.get_by_text("The connection is lost").wait_for()
    page.until(
        "boidsweep.view.banner.hidden && boidsweep.socket.socket.readyState === 1"
    )
    assert page.show is show
    assert page.ask("boidsweep.view.state.settings.cohesion_weight") == 0.1
    trajectory = simulate(live(page).state.job).trajectory
    assert trajectory is not None
    assert np.array_equal(go_to(page, 20), trajectory[20])


def test_a_page_in_a_second_window_takes_the_session_over(opened: Open) -> None:
    page = opened(locale="en")
    name = page.ask("boidsweep.view.page")
    other = page.page.context.new_page()
    other.add_init_script(f"sessionStorage.setItem('boidsweep-page', '{name}')")
    other.goto(page.server.url)
    page.page.get_by_text("This run continues in another window").wait_for()


def test_an_export_is_a_file_to_keep(opened: Open, tmp_path: Path) -> None:
    page = opened()
    go_to(page, 6)
    page.page.get_by_role("button", name="Export").click()
    with page.page.expect_download() as download:
        page.page.get_by_role("menuitem", name="HTML").click()
    assert download.value.suggested_filename.endswith(".html")
    download.value.save_as(tmp_path / "file")
    assert (tmp_path / "file").read_text().lower().startswith("<!doctype html")


STORED = """
study: stored
model: aziel_chen2025
preset: as_run
fixed: {n: 20, steps: 60}
sweep: {fov: [150, 360]}
replicates: 1
seed: 3
record: {series: [coverage], trajectories: true}
"""


def test_a_stored_trial_is_scrubbed_and_changed_by_nothing(
    opened: Open, tmp_path: Path
) -> None:
    study = studies.launched(STORED, tmp_path)
    row = study.trials.iloc[1]
    steps, flight = study.trajectory(row["trial_id"])
    with running_server(lambda: Replay(study, row["trial_id"])) as server:
        page = opened(at=server)
        page.page.get_by_text(
            "Every number equals the stored one, bit for bit"
        ).wait_for()
        scrubber = page.page.get_by_label("step", exact=True)
        for step in (40, 7, 60):
            scrubber.fill(str(step))
            page.until(f"boidsweep.view.stage.frame.step === {step}")
            assert np.array_equal(live(page).bodies, flight[steps.tolist().index(step)])
        both = page.ask("boidsweep.view.state.replay.metrics.coverage")
        assert both == {"stored": row["coverage"], "replayed": row["coverage"]}
        plot = "boidsweep.view.charts.plots.get('coverage')"
        assert page.ask(f"{plot}.series.steps.length") == 61
        assert page.page.locator("input[id$='-fov']").is_disabled()
        page.page.keyboard.press("d")
        page.drag((400, 300), (450, 300))
        page.page.keyboard.press("Space")
        page.until("boidsweep.view.state.running")
        page.until(
            "!boidsweep.view.state.running && boidsweep.view.stage.frame.step === 60"
        )
        assert len(obstacles(page)) == 18


def test_the_page_is_one_text_too_that_does_nothing_before_it_is_mounted(
    browser: Browser,
) -> None:
    """As a notebook and a file on disk have it: all top-level names in one module."""
    page = browser.new_page()
    page.set_content("<body></body>")
    page.add_script_tag(
        content=f"{script('mount')}globalThis.mount = mount;", type="module"
    )
    assert page.evaluate("document.body.children.length") == 0
    said = page.evaluate("""() => {
          const said = [];
          const send = (message) => said.push(message.type);
          mount(document.body, { send, close: () => said.push("closed") }).unmount();
          return [...said, document.body.children.length];
        }""")
    page.close()
    assert said == ["hello", "closed", 0]
    assert "import" not in [line.split(" ")[0] for line in script("view").splitlines()]
    assert "</script" not in script("view")
