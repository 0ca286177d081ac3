"""A session is a run of the kernels as sweeps run them, and says so only as long as it
is.
"""

from pathlib import Path
from typing import Any
from urllib.parse import urlencode

import numpy as np
import pytest
from numpy.typing import NDArray

from kernels.catalogue import BUILT_IN
from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.errors import SpecError
from sweep.spec.recorded import lacks
from sweep.spec.settings import settings_of
from sweep.spec.study import parse_spec
from sweep.trial import looking
from sweep.web.history import MOST, Cursor, History
from sweep.web.live_show import Live
from sweep.web.messages import Shapes
from sweep.web.running import changed, recorded, simulation_of
from sweep.web.session import Session
from sweep.web.state import Range, begin, from_link, from_study
from tests import builders
from tests.cases import slow_but
from tests.specs import short
from tests.studies import launched

Floats = NDArray[np.float64]
DISC = {"disc": {"x": 100.0, "y": 200.0, "radius": 30.0}}


def short_run(
    model: str = "nguyen2024", preset: str = "as_run", **changes: Any
) -> Session:
    """A session of few boids and steps."""
    session = Session(begin(model, preset))
    session.change({"n": 12, "steps": 30} | changes)
    return session


def metrics_of(model: str) -> tuple[str, ...]:
    """All metrics that a model has."""
    return tuple(
        name for name, metric in METRICS.items() if not lacks(MODELS[model], metric)
    )


def to_end(session: Session, steps_a_call: int = 7) -> Floats:
    """The frames from here to the end, the one that is shown first; (F, 4, N)."""
    frames = [session.bodies]
    session.run()
    while session.going:
        frames += list(session.advance(steps_a_call).bodies)
    return np.array(frames)


def launched_frames(session: Session, folder: Path) -> Floats:
    """The frames of a launch of the copied spec, (F, 4, N)."""
    stored = launched(session.state.as_text(), folder).trajectories
    return np.array(
        [np.stack(stored[name].to_list()) for name in ("x", "y", "vx", "vy")]
    ).transpose(1, 0, 2)


@pytest.mark.parametrize("model", MODELS)
def test_a_run_has_the_bits_and_the_metrics_of_a_launch_of_its_spec(
    model: str, tmp_path: Path
) -> None:
    session = short_run(model, steps=20)
    frames = to_end(session)
    assert session.exact
    np.testing.assert_array_equal(frames, launched_frames(session, tmp_path))
    message, _ = session.history.since(Cursor())
    series = launched(session.state.as_text(), tmp_path).series
    assert message is not None
    for name in session.state.plots:
        values = np.array(
            [np.nan if value is None else value for value in message["values"][name]]
        )  # type: ignore[index]
        np.testing.assert_array_equal(values, series[name])


def test_a_run_on_shapes_of_its_own_has_the_bits_of_a_launch(tmp_path: Path) -> None:
    session = short_run("aziel_chen2025")
    session.place(
        [DISC, {"rectangle": {"x": 400.0, "y": 300.0, "width": 333.3, "height": 222.2}}]
    )
    assert session.exact
    np.testing.assert_array_equal(to_end(session), launched_frames(session, tmp_path))


def test_visits_are_not_drawn_while_obstacles_move() -> None:
    """And the page says why; a world at rest draws them."""
    session = short_run()
    session.draw(("coverage",))
    session.follow(())  # metrics are compiled once more for obstacles that move
    session.change({"map": "random_obstacles", "n_obstacles": 3, "obstacle_speed": 1.0})
    with pytest.raises(
        SpecError, match="visits are not counted in a world with moving obstacles"
    ):
        session.draw(("coverage",))


COUNTED = ("coverage", "boid_collisions", "fissions", "path_length")


def told(show: Live, cursor: Cursor) -> tuple[dict[str, Any], Cursor]:
    """The metrics message for the next frame."""
    replies, cursor = show.news(cursor)
    (message,) = (reply for reply in replies if reply["type"] == "metrics")
    return message, cursor


def test_a_fast_run_measures_what_it_shows_with_the_bits_of_a_launch(
    tmp_path: Path,
) -> None:
    """At full speed only shown steps are measured, and what counts up is complete; so
    is a step of the past that is shown later.
    """
    show = Live(begin("nguyen2024", "as_run"))
    show.change({"n": 12, "steps": 60})
    show.follow(("polarization", *COUNTED[:3]))
    series = launched(show.state.as_text(), tmp_path).series
    show.hurry(0)
    show.run()
    cursor = Cursor()
    seen: dict[int, dict[str, float]] = {}

    def look() -> None:
        nonlocal cursor
        message, cursor = told(show, cursor)
        for place, step in enumerate(message["steps"]):
            values = {name: row[place] for name, row in message["values"].items()}
            seen[step] = values

    look()
    while show.going:
        for _ in range(2):
            if show.going:
                show.advance(7)
        look()
    assert [*seen] == [0, 14, 28, 42, 56, 60]
    show.seek(33)
    look()
    assert 33 in seen
    for step, values in seen.items():
        assert values == {
            name: series[name].to_list()[step] for name in show.state.plots
        }


def test_a_metric_that_counts_up_is_complete_wherever_it_is_plotted() -> None:
    """A run counts only what is plotted, and repeats its steps for more; also those
    after a change.
    """
    plain, late = short_run(), short_run()
    plain.follow(COUNTED)
    for session in (plain, late):
        session.run()
        session.advance(11)
    late.follow(COUNTED)
    for session in (plain, late):
        session.advance(3)
        session.change({"cohesion_weight": 0.1})
        session.advance(4)
    for session in (plain, late):
        session.follow(("polarization", *COUNTED[1:]))
    late.follow(("polarization", "escapes", "equilibrium", "coverage"))
    plain.follow(("polarization", "escapes", "equilibrium", "coverage"))
    for session in (plain, late):
        session.advance(12)
    assert plain.step == late.step == 30
    ends = [session.history.rows[-1].values for session in (plain, late)]
    assert ends[0] == ends[1]
    np.testing.assert_array_equal(plain.bodies, late.bodies)


def test_visits_of_what_is_still_floor_stay_where_an_obstacle_moves() -> None:
    """The number at the step of the move is that of the new world, by the same visits,
    and so is the picture.
    """
    show = Live(begin("aziel_chen2025", "as_run"))
    show.change({"n": 20, "steps": 200, "map": "empty"})
    show.place([DISC])
    show.follow(("coverage", "coverage_total"))
    show.draw(("coverage",))
    show.take_steps(90)
    while show.going:
        show.advance(90)
    before = looking.visits(show.simulation)
    moved = {"disc": DISC["disc"] | {"x": 330.0}}
    show.handle(Shapes([moved]))
    after = looking.visits(show.simulation)
    floor = (before >= 0) & (after >= 0)
    assert (before < 0).sum() > 1000
    assert ((before < 0) & (after >= 0)).sum() > 1000
    np.testing.assert_array_equal(after[floor], before[floor])
    assert (after[(before < 0) & (after >= 0)] == 0).all()
    share = 100 * (after > 0).sum() / (after >= 0).sum()
    assert show.history.rows[-1].step == 90
    assert show.history.rows[-1].values["coverage"] == share
    show.undo()
    assert show.history.rows[-1].values["coverage"] == (
        100 * (before > 0).sum() / (before >= 0).sum()
    )


def test_other_pixels_begin_visits_anew_and_the_page_says_so() -> None:
    show = Live(begin("aziel_chen2025", "as_run"))
    show.change({"n": 20, "steps": 200, "map": "empty"})
    show.follow(("coverage", "speed"))
    show.take_steps(40)
    while show.going:
        show.advance(40)
    assert show.history.rows[-1].values["coverage"] > 0
    show.change({"pixel": 4.0})
    message, _ = told(show, Cursor())
    assert message["restarts"] == {"coverage": [40]}
    assert message["values"]["coverage"][-1] == 0.0
    assert "visits count from step 40 on, because the pixels or" in show.note
    show.seek(39)
    assert "visits count" not in show.note


def taken(show: Live, steps: int) -> Live:
    """A run after some more steps."""
    show.take_steps(steps)
    while show.going:
        show.advance(steps)
    return show


@pytest.mark.parametrize(
    ("model", "name", "value", "metric"),
    [
        ("rustamani2024", "goal_x", -91.0, "goal_distance"),
        ("patel2023", "obstacle_speed", 0.5, "coverage_total"),
    ],
)
def test_a_metric_that_earlier_steps_cannot_have_is_refused(
    model: str, name: str, value: float, metric: str
) -> None:
    """The run stays as it was: no step of the past ends the session."""
    show = Live(begin(model, "as_written"))
    before = show.state.settings[name]
    show.follow(("speed",))
    taken(show, 4).change({name: value})
    taken(show, 3).change({name: before})
    taken(show, 2)
    with pytest.raises(SpecError, match="with the parameters from step 4 on: "):
        show.follow((metric,))
    assert show.state.plots == ("speed",)
    for step in (5, 8, 2):
        show.seek(step)
        told(show, Cursor())
    show.reset()
    show.follow((metric,))


def test_a_change_that_is_taken_back_has_the_number_of_its_world() -> None:
    show = Live(begin("rustamani2024", "as_written"))
    show.follow(("goal_distance",))
    taken(show, 20)
    goal = float(show.state.settings["goal_x"])
    value = show.history.rows[-1].values["goal_distance"]
    show.change({"goal_x": goal - 3})
    assert show.history.rows[-1].values["goal_distance"] != value
    show.change({"goal_x": goal})
    assert show.exact
    assert show.history.rows[-1].values["goal_distance"] == value


def test_visits_begin_anew_when_obstacles_cease_to_move_and_the_page_says_so() -> None:
    show = Live(begin("patel2023", "as_written"))
    show.follow(("speed",))
    show.change({"obstacle_speed": 0.5})
    taken(show, 6).change({"obstacle_speed": 0.0})
    show.draw(("coverage",))
    assert show.restarts == [6]
    assert "visits count from step 6 on" in show.note


def test_a_second_run_with_another_preset_counts_for_the_overlays() -> None:
    show = Live(begin("rustamani2024", "as_written"))
    show.follow(("speed",))
    show.draw(("coverage",))
    other = show.beside("as_run")
    assert other.overlays == ("coverage",)
    assert looking.counts_visits(other.simulation)


def test_a_kept_run_with_a_sweep_opens_again() -> None:
    state = begin("nguyen2024", "as_run").sweep("separation_weight", Range(0.5, 2, 3))
    kept = state.as_trial()
    part = urlencode({"spec": kept["yaml"], "point": kept["point"]})
    assert from_link(f"http://127.0.0.1/#{part}").opened is not None


def test_steps_that_were_asked_for_are_taken_after_a_new_metric() -> None:
    show = Live(begin("aziel_chen2025", "as_run").with_settings({"n": 10}))
    show.follow(("speed",))
    show.take_steps(50)
    show.advance(20)
    show.follow(("speed", "fissions"))
    assert (show.step, show.aim) == (20, 50)


def test_looking_changes_nothing() -> None:
    """Overlays, a selected boid, other plots and another pace."""
    plain, watched = to_end(short_run()), short_run()
    watched.draw(("flocks", "coverage", "accelerations"))
    watched.select(3)
    watched.hurry(0)
    watched.sweep("cohesion_weight", Range(0, 1, 3))
    watched.run()
    watched.advance(11)
    watched.follow(("polarization", "equilibrium"))
    np.testing.assert_array_equal(to_end(watched, 3), plain[11:])
    assert watched.exact


@pytest.mark.parametrize(
    ("model", "preset"), slow_but(builders.LAST_PRESETS, builders.PRESETS)
)
def test_a_simulation_in_the_place_of_another_goes_on_as_that_would(
    model: str, preset: str
) -> None:
    """With the same settings; some boids are at rest, where it matters what they faced
    before.
    """
    view = {"fov": 200} if "fov" in settings_of(model, BUILT_IN) else {}
    job = begin(model, preset).with_settings({"n": 90, "steps": 30} | view).job
    names = [
        name for name, metric in METRICS.items() if not lacks(MODELS[model], metric)
    ]
    record = recorded(job, names, visits=True)
    whole, earlier = simulation_of(job, record), simulation_of(job, record)
    for simulation in (whole, earlier):
        while simulation.step < 13:
            simulation.advance(13 - simulation.step)
            simulation.take_frames()
        simulation.flock.vx[::3] = simulation.flock.vy[::3] = 0.0
    later = changed(earlier, job, record)
    for simulation in (whole, later):
        while simulation.steps_left:
            simulation.advance(30)
            simulation.take_frames()
    np.testing.assert_array_equal(np.stack(later.flock), np.stack(whole.flock))
    np.testing.assert_array_equal(
        later.flight.record.watch.events, whole.flight.record.watch.events
    )
    np.testing.assert_array_equal(
        later.flight.record.coverage.visits, whole.flight.record.coverage.visits
    )
    np.testing.assert_array_equal(
        later.flight.record.coverage.sums, whole.flight.record.coverage.sums
    )


@pytest.mark.parametrize(
    "change",
    [
        {"cohesion_weight": 0.0},
        {"separation_range": 5.0},
        {"update": "synchronous"},
        {"borders": "bounded"},
        {"width": 900.0},
        {"obstacle_radius": 60.0},
        {"max_force": 0.1},
    ],
)
def test_a_setting_changed_on_the_way_acts_from_there_on_and_is_said(
    change: dict[str, Any],
) -> None:
    plain, session = to_end(short_run(n=30, steps=200)), short_run(n=30, steps=200)
    session.take_steps(20)
    while session.going:
        session.advance(20)
    session.change(change)
    assert (session.step, session.exact) == (20, False)
    assert (
        session.note
        == f"{next(iter(change))} changed, last at step 20; reset shows the run of the"
        " spec"
    )
    np.testing.assert_array_equal(session.bodies, plain[20])
    assert not np.array_equal(to_end(session)[-1], plain[-1])


def test_after_a_reset_a_changed_run_is_exact_again(tmp_path: Path) -> None:
    session = short_run()
    session.run()
    session.advance(10)
    session.change({"cohesion_weight": 3})
    session.place([DISC])
    assert session.note.startswith(
        "cohesion_weight, obstacles changed, last at step 10"
    )
    session.reset()
    assert (session.step, session.exact, session.note, session.running) == (
        0,
        True,
        "",
        True,
    )
    np.testing.assert_array_equal(to_end(session), launched_frames(session, tmp_path))


@pytest.mark.parametrize(
    "change",
    [{"n": 5}, {"seed": 3}, {"map": "empty"}, {"start_speed": 0.5}, {"steps": 9}],
)
def test_what_makes_another_start_begins_anew_and_goes_on_running(
    change: dict[str, Any],
) -> None:
    session = short_run()
    session.run()
    session.advance(10)
    session.change(change)
    assert (session.step, session.exact, session.running) == (0, True, True)


def test_obstacles_set_on_the_way_are_avoided() -> None:
    """Boids of aziel_chen2025 fly at up to 5 px a step, and an obstacle repels them
    without bound at its surface.
    """
    session = short_run("aziel_chen2025", n=60, steps=400, map="empty")
    session.take_steps(20)
    while session.going:
        session.advance(20)
    x, y = session.bodies[:2]
    free = max(
        ((cx, cy) for cx in range(150, 700, 10) for cy in range(150, 500, 10)),
        key=lambda place: float(np.hypot(x - place[0], y - place[1]).min()),
    )
    radius = float(np.hypot(x - free[0], y - free[1]).min()) - 15.0
    plain, disc = (
        short_run("aziel_chen2025", n=60, steps=400, map="empty"),
        {"x": free[0], "y": free[1]},
    )
    through = to_end(plain)[20:]
    session.place([{"disc": disc | {"radius": radius}}])
    around = to_end(session)
    depths = [
        radius - np.hypot(run[:, 0] - free[0], run[:, 1] - free[1])
        for run in (through, around)
    ]
    assert radius > 10
    assert (depths[0] > 0).mean() > 10 * (depths[1] > 0).mean()


@pytest.mark.parametrize("model", ["nguyen2024", "rustamani2024"])
def test_a_run_that_goes_on_is_the_longer_run_of_its_spec(
    model: str, tmp_path: Path
) -> None:
    session = short_run(model, steps=12)
    first = to_end(session)
    with pytest.raises(
        SpecError, match="has ended after 12 steps; continue extends the run"
    ):
        session.run()
    session.extend()
    assert (session.running, session.exact, session.state.settings["steps"]) == (
        True,
        True,
        24,
    )
    frames = np.concatenate([first, to_end(session)[1:]])
    np.testing.assert_array_equal(frames, launched_frames(session, tmp_path))


def test_a_run_whose_noise_depends_on_its_length_says_so_when_it_goes_on() -> None:
    session = Session(from_study(parse_spec(short("fixed: {n: 5, steps: 6}"))))
    to_end(session)
    session.extend()
    assert (session.exact, session.note) == (
        False,
        "steps changed, last at step 6; reset shows the run of the spec",
    )


def test_a_run_that_diverges_pauses_and_says_so() -> None:
    session = short_run(dt=1e300)
    session.run()
    session.advance(5)
    assert (session.going, session.diverged) == (False, True)
    assert np.isfinite(session.bodies).all()
    with pytest.raises(
        SpecError, match=r"the run diverged at step 1: .*; reset begins again"
    ):
        session.run()
    session.change({"dt": 1})
    assert (session.step, session.diverged, session.exact) == (0, False, True)


@pytest.mark.parametrize("do", [
    lambda session: session.change({"cohesion_wieght": 1}),
    lambda session: session.change({"n": 200_000}),
    lambda session: session.place([{"disk": {}}]),
    lambda session: session.choose("nguyen2025", "as_run"),
    lambda session: session.follow(("sped",)),
    lambda session: session.draw(("flocs",)),
    lambda session: session.select(12),
    lambda session: session.hurry(-1.0),
    lambda session: session.sweep("cohesion_weight", Range(1, 2, 0)),
])  # fmt: skip
def test_what_is_refused_changes_nothing(do: Any) -> None:
    session = short_run()
    session.run()
    session.advance(4)
    state, simulation, version = session.state, session.simulation, session.version
    with pytest.raises(SpecError):
        do(session)
    assert (session.state, session.simulation, session.version) == (
        state,
        simulation,
        version,
    )
    assert (session.step, session.running, session.exact) == (4, True, True)


def test_single_steps_and_a_pause() -> None:
    session = short_run()
    session.take_steps(3)
    assert (session.going, session.running) == (True, False)
    session.advance(100)
    assert (session.going, session.step) == (False, 3)
    session.run()
    session.pause()
    assert not session.going


def test_a_flock_that_shrinks_has_no_selected_boid_any_more() -> None:
    session = short_run()
    session.select(11)
    session.change({"n": 12})
    assert session.selected == 11
    session.change({"n": 11})
    assert session.selected is None


def test_visits_of_a_large_world_are_counted_for_a_metric_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sweep.web.running.MOST_PIXELS", 1000)
    session = short_run()
    session.run()
    session.advance(5)
    with pytest.raises(SpecError, match="plot coverage first, or change pixel"):
        session.draw(("coverage",))
    session.follow(("speed",))
    assert session.step == 5
    session.follow(("coverage",))
    assert (session.step, session.running) == (5, True)
    session.draw(("coverage",))


def test_another_model_begins_with_its_preset_and_stands_still() -> None:
    session = short_run(seed=8)
    session.run()
    session.choose("patel2023", "as_written")
    assert (session.state.model, session.state.seed, session.running) == (
        "patel2023",
        8,
        False,
    )
    assert session.n == MODELS["patel2023"].presets["as_written"]["n"]


@pytest.mark.parametrize("model", slow_but(["nguyen2024", "strombom2014"], MODELS))
def test_every_metric_of_a_model_can_be_plotted_at_any_time(model: str) -> None:
    names = metrics_of(model)
    session = short_run(model)
    session.run()
    session.advance(3)
    session.follow(names)
    session.advance(2)
    message, _ = session.history.since(Cursor())
    assert message is not None
    assert (message["steps"], message["reset"]) == ([0, 1, 2, 3, 4, 5], True)
    values: dict[str, list[float | None]] = message["values"]
    assert values.keys() == set(names)
    plotted = begin(model, "as_run").plots
    for name, column in values.items():
        assert (column[:3] == [None] * 3) is not (name in plotted)


def test_a_run_without_a_plot_goes_on_and_plots_come_back() -> None:
    session = short_run()
    session.run()
    session.advance(4)
    names = session.state.plots
    session.follow(())
    session.advance(3)
    message, _ = session.history.since(Cursor())
    assert message is not None
    assert (message["steps"], message["values"]) == ([*range(8)], {})
    session.seek(2)
    session.reset()
    session.run()
    session.advance(4)
    session.follow(names)
    session.advance(3)
    message, _ = session.history.since(Cursor())
    assert message is not None
    values: dict[str, list[float | None]] = message["values"]
    for column in values.values():
        assert column[:4] == [None] * 4
        assert None not in column[4:]
    assert session.exact


def test_a_long_history_is_thinned_evenly_and_told_once() -> None:
    history, cursor = History(), Cursor()
    history.begin(("speed",))
    told: list[int] = []
    for first in range(0, 3 * MOST, 100):
        steps = np.arange(first, first + 100)
        history.add(steps, {"speed": 2.0 * steps})
        message, cursor = history.since(cursor)
        told += message["steps"] if message else []  # type: ignore[operator]
    kept = [row.step for row in history.rows]
    last = told[-1]
    assert len(kept) <= MOST
    assert kept == list(range(0, kept[-1] + 1, history.every))
    assert told == sorted(set(told))
    assert last == int(steps[-1])
    assert history.since(cursor) == (None, cursor)
    message, _ = history.since(Cursor())
    assert message == {
        "type": "metrics",
        "steps": [*kept, last],
        "values": {"speed": [2.0 * step for step in [*kept, last]]},
        "reset": True,
    }


def test_values_of_steps_in_any_order_are_told_in_order_and_once() -> None:
    history, cursor = History(), Cursor()
    history.begin(("speed",))
    for steps in ([0, 40, 20], [20, 30], [10]):
        history.add(np.array(steps), {"speed": np.array(steps) / 4})
    message, cursor = history.since(cursor)
    assert message is not None
    assert message["steps"] == [0, 10, 20, 30, 40]
    assert message["values"] == {"speed": [0.0, 2.5, 5.0, 7.5, 10.0]}
    history.follow(("speed", "turn_rate"))
    history.add(np.array([20]), {"speed": np.zeros(1), "turn_rate": np.ones(1)})
    assert history.knows(20)
    assert not history.knows(30)
    message, _ = history.since(cursor)
    assert message is not None
    values: dict[str, list[float | None]] = message["values"]  # type: ignore[assignment]
    assert values["speed"] == [0.0, 2.5, 5.0, 7.5, 10.0]
    assert values["turn_rate"] == [None, None, 1.0, None, None]


def test_another_preset_keeps_what_was_changed_and_the_same_one_begins_anew() -> None:
    session = short_run(cohesion_weight=0.3)
    session.place([DISC])
    session.follow(("speed",))
    before = dict(session.state.fixed)
    session.choose("nguyen2024", "as_written")
    assert session.state.settings["cohesion_weight"] == 0.3
    assert session.state.fixed == before
    assert (len(session.state.shapes or ()), session.state.plots) == (1, ("speed",))
    session.choose("nguyen2024", "as_written")
    assert (session.state.fixed, session.state.shapes) == ({}, None)
