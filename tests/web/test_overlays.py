"""What is drawn besides the boids is what the kernels do."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from examples import vortex
from kernels.catalogue import BUILT_IN
from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.spec.settings import preset_settings, settings_of
from sweep.trial import looking
from sweep.trial.simulation import Simulation
from sweep.web import encoding, overlays
from sweep.web.claimed import published
from sweep.web.controls import EXPERIMENTS, controls
from sweep.web.running import recorded, simulation_of
from sweep.web.state import begin
from tests import ROOT, builders, oscillators
from tests.cases import slow_but

FIELDS_OF_VIEW = [
    ("aziel_chen2025", "as_written"),
    ("rustamani2024", "as_run"),
    ("nguyen2024", "as_run"),
]


def flown(
    model: str, preset: str = "as_run", steps: int = 5, **changes: object
) -> Simulation:
    """A simulation after a few steps."""
    job = begin(model, preset).with_settings({"n": 60} | changes).job
    simulation = simulation_of(job, recorded(job, (), visits=True))
    while simulation.step < steps:
        simulation.advance(steps - simulation.step)
        simulation.take_frames()
    return simulation


def found_slowly(simulation: Simulation, boid: int) -> list[int]:
    """The neighbours of a boid, by distances and angles of all."""
    flock, world, settings = simulation.flock, simulation.world, simulation.job.settings
    reach, fov, inclusive = simulation.flight.model.sight(simulation.flight.params)
    dx, dy = flock.x - flock.x[boid], flock.y - flock.y[boid]
    if settings["minimum_image"]:
        dx = dx - world.width * np.round(dx / world.width)
        dy = dy - world.height * np.round(dy / world.height)
    distance = np.hypot(dx, dy)
    seen = distance <= reach if inclusive else distance < reach
    vx, vy = flock.vx[boid], flock.vy[boid]
    if simulation.job.model == "rustamani2024":
        work = simulation.flight.work
        vx, vy = work.heading_x[boid], work.heading_y[boid]
    if vx != 0.0 or vy != 0.0:
        turn = np.arctan2(dy, dx) - np.arctan2(vy, vx)
        seen &= np.abs((turn + np.pi) % (2 * np.pi) - np.pi) <= np.radians(fov / 2)
    seen[boid] = False
    return [int(other) for other in np.flatnonzero(seen)]


@pytest.mark.parametrize(
    ("model", "preset", "minimum_image"),
    slow_but(
        [(*of, bool(at % 2)) for at, of in enumerate(builders.PRESETS)],
        [(*of, shortest) for of in builders.PRESETS for shortest in (False, True)],
    ),
)
def test_neighbours_are_those_in_range_and_in_view(
    model: str, preset: str, minimum_image: bool
) -> None:
    ideal = builders.IDEAL | {"minimum_image": minimum_image}
    simulation = flown(model, preset, borders="torus", **ideal)
    views = [looking.seen_by(simulation, boid) for boid in range(60)]
    assert [view.neighbours for view in views] == [
        found_slowly(simulation, boid) for boid in range(60)
    ]
    assert any(view.neighbours for view in views)


@pytest.mark.parametrize(("model", "preset"), FIELDS_OF_VIEW)
def test_the_view_is_about_the_velocity_and_at_rest_as_the_model_says(
    model: str, preset: str
) -> None:
    changes = {"fov": 120} if "fov" in settings_of(model, BUILT_IN) else {}
    simulation = flown(model, preset, **changes)
    flock = simulation.flock
    seen = looking.seen_by(simulation, 7)
    limited = "fov" in settings_of(model, BUILT_IN)
    assert seen.range == simulation.flight.model.sight(simulation.flight.params).range
    assert seen.fov == (120 if limited else 360)
    assert seen.heading == (math.atan2(flock.vy[7], flock.vx[7]) if limited else None)
    flock.vx[7] = flock.vy[7] = 0.0
    at_rest = looking.seen_by(simulation, 7)
    assert at_rest.neighbours == found_slowly(simulation, 7)
    assert at_rest.heading == (seen.heading if model == "rustamani2024" else None)


@pytest.mark.parametrize("model", MODELS)
def test_looking_at_everything_leaves_the_run_as_it_is(model: str) -> None:
    watched, plain = flown(model), flown(model)
    (
        looking.accelerations(watched),
        looking.flocks(watched),
        looking.visits(watched),
        looking.seen_by(watched, 3),
    )
    for simulation in (watched, plain):
        simulation.advance(3)
    np.testing.assert_array_equal(np.stack(watched.flock), np.stack(plain.flock))
    np.testing.assert_array_equal(
        watched.flight.record.watch.events, plain.flight.record.watch.events
    )


def test_a_rule_alone_has_the_acceleration_of_a_model_with_that_rule_only() -> None:
    """nguyen2024 takes v(1) = (v + a dt)(1 - drag); rules have no common limit, so that
    they add up.
    """
    simulation = flown(
        "nguyen2024", drag=0.0, dt=0.5, update="synchronous", obstacle_range=500
    )
    by_rule = looking.accelerations(simulation)
    assert looking.rules(simulation) == [
        "separation",
        "alignment",
        "cohesion",
        "wander",
        "obstacle",
    ]
    before = np.stack([simulation.flock.vx, simulation.flock.vy])
    simulation.advance(1)
    after = np.stack([simulation.flock.vx, simulation.flock.vy])
    np.testing.assert_allclose(by_rule.sum(axis=0), (after - before) / 0.5, atol=1e-12)
    assert (np.abs(by_rule) > 0).any(axis=(1, 2)).all()


def test_a_rule_without_weight_has_no_arrows() -> None:
    simulation = flown("patel2023", cohesion_weight=0.0)
    assert looking.rules(simulation) == ["separation", "alignment", "obstacle"]
    assert looking.accelerations(simulation).shape == (3, 2, 60)
    none = flown("nanobot", separation_weight=0, alignment_weight=0, cohesion_weight=0)
    assert looking.accelerations(none).shape == (0, 2, 60)


def test_flocks_are_those_of_the_metric() -> None:
    simulation = flown("nanobot", steps=40)
    labels = looking.flocks(simulation)
    values = np.empty(1)
    flight = simulation.flight
    flight.record.frames.bodies[0, :4] = np.stack(simulation.flock[:4])
    METRICS["flock_count"].measure(
        flight.record.frames, 1, flight.ground, flight.observation, values
    )
    assert len(set(labels.tolist())) == values[0]
    flag, section = encoding.flocks(labels)
    shown = np.frombuffer(section, "<u2", 60)
    for boid in range(60):
        flock = np.flatnonzero(labels == labels[boid])
        assert shown[boid] == (flock.min() if len(flock) > 1 else encoding.ALONE)
    assert (flag, len(section) % 4) == (1, 0)


@pytest.mark.parametrize("steps", [1, 30])
@pytest.mark.parametrize(
    ("model", "changes"),
    [
        ("aziel_chen2025", {"map": "cafeteria"}),
        ("nguyen2024", {"map": "random_obstacles"}),
    ],
)
def test_what_is_painted_of_the_floor_is_the_metric(
    model: str, changes: dict[str, object], steps: int
) -> None:
    """The opacities of all cells, each for its pixels outside of obstacles, sum up to
    the metric coverage, to the 254th part of a cell: also at an early step, when most
    cells that discs have touched are partly visited.
    """
    simulation = flown(model, steps=steps, **changes)
    counted = simulation.flight.record.coverage
    pixels = looking.visits(simulation)
    assert (pixels >= 0).sum() == counted.traversable
    assert (pixels > 0).sum() == counted.sums[0]
    shares = overlays.visited_shares(pixels)
    assert shares.size <= overlays.MOST_CELLS < pixels.size
    side = -(-counted.rows // shares.shape[0])
    room = [(0, -length % side) for length in pixels.shape]
    blocks = np.pad(pixels, room, constant_values=-1).reshape(
        shares.shape[0], side, shares.shape[1], side
    )
    free = (blocks >= 0).sum(axis=(1, 3))
    _, section = encoding.coverage(shares)
    rows, columns = np.frombuffer(section, "<u4", 2)
    shown = np.frombuffer(section, np.uint8, rows * columns, 8).reshape(rows, columns)
    np.testing.assert_array_equal(shown == encoding.BLOCKED, free == 0)
    opacity = np.where(free == 0, 0, shown / encoding.WHOLE)
    metric = counted.sums[0] / counted.traversable
    painted = (opacity * free).sum() / free.sum()
    assert painted == pytest.approx(metric, abs=1 / (2 * encoding.WHOLE))
    if steps == 1:
        assert (opacity[opacity > 0] < 1).mean() > 0.2
    else:
        assert (shown == encoding.BLOCKED).any()


@pytest.mark.parametrize("n", [1, 2, 3, 100])
def test_a_frame_is_what_it_stands_for_to_a_65535th_of_its_box(n: int) -> None:
    rng = np.random.default_rng(n)
    bodies = np.stack(
        [rng.uniform(-50, 900, n), rng.uniform(0, 2000, n), *rng.normal(size=(2, n))]
    )
    content = encoding.frame(
        7, bodies, (800.0, 600.0), [encoding.accelerations(np.ones((2, 2, n)))]
    )
    magic, flags, step, count, left, top, right, bottom = encoding.HEAD.unpack_from(
        content
    )
    assert (magic, flags, step, count) == (b"BSF1", 2, 7, n)
    assert (left, right) == pytest.approx(
        (min(0, bodies[0].min()), max(800, bodies[0].max())), rel=1e-6
    )
    assert (top, bottom) == pytest.approx(
        (0, min(1200, max(600, bodies[1].max()))), rel=1e-6
    )
    x, y = np.frombuffer(content, "<u2", 2 * n, encoding.HEAD.size).reshape(2, n)
    assert (
        np.abs(left + x * (right - left) / 65535 - bodies[0]).max()
        <= 0.51 * (right - left) / 65535
    )
    shown = np.minimum(bodies[1], 1200)
    assert (
        np.abs(top + y * (bottom - top) / 65535 - shown).max()
        <= 0.51 * (bottom - top) / 65535
    )
    heading = np.frombuffer(content, np.uint8, n, encoding.HEAD.size + 4 * n) * (
        2 * np.pi / 256
    )
    turn = heading - np.arctan2(bodies[3], bodies[2])
    assert np.abs((turn + np.pi) % (2 * np.pi) - np.pi).max() <= 1.001 * np.pi / 256
    rest = encoding.HEAD.size + len(encoding.padded(bytes(5 * n)))
    assert np.frombuffer(content, "<u4", 1, rest)[0] == 2
    assert len(content) == rest + 4 + 2 * 2 * n * 4


@pytest.fixture
def entered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setitem(MODELS, "vortex", vortex.MODEL)
    settings_of.cache_clear()
    yield
    settings_of.cache_clear()


@pytest.mark.usefixtures("entered")
@pytest.mark.parametrize("model", [*MODELS, "vortex"])
def test_every_setting_has_a_control_and_a_new_model_too(model: str) -> None:
    for preset in MODELS[model].presets:
        values = MODELS[model].preset_values(preset)
        message = json.loads(
            json.dumps(
                controls(model, preset, experiments=Path("nowhere")), allow_nan=False
            )
        )
        shown = {
            setting["name"]: setting
            for group in message["groups"]
            for setting in group["fields"]
        }
        assert list(shown) == list(settings_of(model, BUILT_IN))
        for name, setting in shown.items():
            assert setting["text"]
            assert setting["default"] == (
                "inf" if values[name] == math.inf else values[name]
            )
            if setting["slider"]:
                low, high, step = setting["slider"]
                assert low <= values[name] <= high, name
                assert settings_of(model, BUILT_IN)[name].coerce(low) == low
                assert settings_of(model, BUILT_IN)[name].coerce(high) == high
                assert 0 < step <= high - low
        assert {entry["name"] for entry in message["metrics"]} >= set(
            MODELS[model].metrics
        )


def test_the_page_says_which_torus_wraps_positions_only() -> None:
    message = controls("nguyen2024", "as_run", experiments=Path("nowhere"))
    texts = {one["name"]: one["texts"] for one in message["models"]}
    half = [
        (model, preset)
        for model, said in texts.items()
        for preset, text in said.items()
        if "the torus wraps positions only: boids do not perceive" in text
    ]
    assert half == [("nguyen2024", "as_run")]
    assert texts["nguyen2024"]["as_run"].startswith("as the authors' program does")


def test_maps_and_metrics_that_do_not_go_with_a_model_are_not_offered() -> None:
    message = controls("rustamani2024", "as_run", ("lab",), experiments=Path("nowhere"))
    names = {entry["name"] for entry in message["maps"]}
    assert {"arena", "empty", "random_obstacles", "lab"} <= names
    assert "cafeteria" not in names
    assert "potential" not in {entry["name"] for entry in message["metrics"]}


def test_metrics_of_state_and_kinds_are_for_models_that_have_them() -> None:
    counting = oscillators.ORDER._replace(counts=True)
    with builders.entered(oscillators.MODEL, order=oscillators.ORDER, count=counting):
        for model in ("nguyen2024", "oscillators"):
            message = controls(model, "as_run", experiments=Path("nowhere"))
            offered = {entry["name"] for entry in message["metrics"]}
            own = model == "oscillators"
            assert ({"order", "count"} <= offered) == own
            assert ("order" in offered) == own


def test_published_numbers_come_with_the_settings_that_they_hold_for() -> None:
    numbers = published("nguyen2024", "as_run", ROOT / EXPERIMENTS)
    starts = [
        about for name, about in numbers if name == "speed" and about["frame"] == 0
    ]
    assert starts[0]["value"] == 0.765
    preset = preset_settings("nguyen2024", "as_run", BUILT_IN)
    assert starts[0]["settings"] == preset | {"n": 200, "steps": 500}
    assert published("nguyen2024", "as_run", ROOT / "nowhere") == ()


def test_a_number_over_points_or_on_a_drawn_map_is_of_no_one_setting(
    tmp_path: Path,
) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "a.yaml").write_text(
        "study: a\nmodel: nguyen2024\nreplicates: 1\nfixed: {map: lab, n: 20}\n"
        "maps: {lab: {size: [90, 90], shapes: []}}\n"
        "sweep: {separation_weight: [1, 2], alignment_weight: [1, 2]}\n"
    )
    (tmp_path / "one" / "published.yaml").write_text(
        "claims:\n  - {where: Table 1, says: fast, spec: a, expect: {value: 3},\n"
        "     measure: {mean: speed, for: {separation_weight: 2}}}\n"
    )
    ((metric, number),) = published("nguyen2024", "as_run", tmp_path)
    assert (metric, number["value"]) == ("speed", 3)
    settings = number["settings"]
    nothing = {name for name, value in settings.items() if value is None}
    assert nothing == {"alignment_weight", "map"}
    assert (settings["separation_weight"], settings["n"]) == (2, 20)
