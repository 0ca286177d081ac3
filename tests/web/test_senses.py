"""What the script of a recording tells from places: whom a boid sees, who flocks
together and what was visited, against the kernels.
"""

import base64
import json
from itertools import combinations, pairwise
from math import acos, degrees, hypot, pi, radians
from operator import itemgetter
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from sweep.trial import looking
from sweep.trial.simulation import Simulation
from sweep.web.encoding import ALONE, HEAD
from sweep.web.flight import fly
from sweep.web.live_show import Live
from sweep.web.page import STATIC
from sweep.web.recording import recorded_run
from sweep.web.running import recorded, simulation_of
from sweep.web.state import ViewState, begin
from tests.web.scripts import frames_of, printed

SCRIPT = Template("""
import { framesOf } from "$static/packed.js";
import { Tape } from "$static/tape.js";
import { Senses } from "$static/senses.js";
import { Visits } from "$static/visits.js";
const recording = $recording;
recording.frames = await framesOf(recording.frames, recording.steps.length);
const { senses: about, scene } = recording;
const tape = new Tape(recording);
const senses = new Senses(about, scene);
const visits = new Visits(tape, about.pixels, scene);
const told = [];
for (let place = 0; place <= tape.last; place++) {
  const frame = tape.frame(place);
  const seen = Array.from({ length: frame.n }, (_, i) => senses.seen(frame, place, i));
  told.push({ seen, flocks: [...senses.flocks(frame)] });
}
const last = [...visits.until(tape.last).shares];
const before = [...visits.until(tape.last - 7).shares];
const places = [tape.at(-1), tape.at(0), tape.at(16), tape.at(17), tape.at(1e9)];
console.log(JSON.stringify({ told, before, last, places }));
""")
CASES: list[tuple[str, str, dict[str, object]]] = [
    ("nguyen2024", "as_run", {"n": 40, "borders": "torus", "minimum_image": True}),
    ("aziel_chen2025", "as_run", {"n": 40, "fov": 200.0, "perception_range": 90.0}),
    ("rustamani2024", "as_run", {"n": 20, "fov": 120.0}),
    ("nanobot", "as_written", {"n": 40}),
]
MODEL = itemgetter(0)
TURN = 2 * pi / 256
"""The finest heading."""


class Told(NamedTuple):
    """A recording, what the script tells of it, and its places (F, 2, N) as the script
    reads them; `unit` is the finest difference of two places.
    """

    recording: dict[str, Any]
    told: dict[str, Any]
    places: NDArray[np.float64]
    unit: float


def tell(tmp_path: Path, state: ViewState) -> Told:
    """What the script tells of a run of this state."""
    greeting = Live(state).greeting()
    said = {message["type"]: message for message in greeting}
    run = recorded_run(fly("a/study", state.job, state.plots), said, state.as_text())
    script = SCRIPT.substitute(static=STATIC.as_uri(), recording=json.dumps(run))
    n, content = int(state.settings["n"]), frames_of(run)
    size = len(content) // len(run["steps"])
    places, units = [], []
    for at in range(0, len(content), size):
        _, _, _, _, left, top, right, bottom = HEAD.unpack_from(content, at)
        across, along = np.frombuffer(content, "<u2", 2 * n, at + HEAD.size).reshape(
            2, n
        )
        span = right - left, bottom - top
        places.append([left + across / 65535 * span[0], top + along / 65535 * span[1]])
        units.append(max(span) / 65535)
    return Told(run, printed(script, tmp_path), np.array(places), max(units))


@pytest.fixture(scope="module")
def case(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Told, ViewState]:
    """A short run as the script tells it, and its state at the start."""
    model, preset, changes = request.param
    state = begin(model, preset).with_settings({**changes, "steps": 30})
    return tell(tmp_path_factory.mktemp("told"), state), state


@pytest.mark.parametrize("case", CASES, ids=MODEL, indirect=True)
def test_a_recording_tells_whom_boids_see_but_at_the_very_border(
    case: tuple[Told, ViewState],
) -> None:
    """Where script and kernel differ, the other boid is as near to the border of the
    range, or of the cone, as places and headings are fine.
    """
    found, state = case
    simulation = simulation_of(state.job, recorded(state.job, (), visits=True))
    seen_at_all = differing = 0
    for place, frame in enumerate(found.told["told"]):
        if place:
            simulation.advance(1)
            simulation.take_frames()
        for boid, one in enumerate(frame["seen"]):
            exact = looking.seen_by(simulation, boid)
            assert one["fov"] == exact.fov
            assert (one["heading"] is None) == (exact.heading is None)
            if exact.heading is not None:
                apart = abs(one["heading"] - exact.heading) % (2 * pi)
                assert min(apart, 2 * pi - apart) <= 0.51 * TURN
            seen_at_all += len(exact.neighbours)
            for other in set(one["neighbours"]) ^ set(exact.neighbours):
                differing += 1
                assert _at_the_border(simulation, boid, other, found.unit)
    assert seen_at_all > 100
    assert differing < 0.05 * seen_at_all


def _at_the_border(simulation: Simulation, boid: int, other: int, unit: float) -> bool:
    flock, sight = simulation.flock, looking.sight(simulation)
    dx, dy = flock.x[other] - flock.x[boid], flock.y[other] - flock.y[boid]
    if simulation.world.minimum_image:
        for_width = round(dx / simulation.world.width) * simulation.world.width
        for_height = round(dy / simulation.world.height) * simulation.world.height
        dx, dy = dx - for_width, dy - for_height
    distance = hypot(dx, dy)
    if abs(distance - sight.range) <= 3 * unit:
        return True
    heading = looking.seen_by(simulation, boid).heading
    if heading is None:
        return False
    ahead = (dx * np.cos(heading) + dy * np.sin(heading)) / distance
    off = abs(acos(min(1.0, max(-1.0, ahead))) - radians(sight.fov / 2))
    return degrees(off) <= degrees(TURN) + degrees(3 * unit / distance)


@pytest.mark.parametrize("case", CASES[:2], ids=MODEL, indirect=True)
def test_a_recording_tells_who_flocks_together(
    case: tuple[Told, ViewState],
) -> None:
    """By their places as recorded: all boids that are joined by pairs nearer than the
    range, named by the first of them.
    """
    found, _ = case
    reach = found.recording["senses"]["flock_range"]
    sizes = set()
    for (x, y), frame in zip(found.places, found.told["told"], strict=True):
        name = list(range(x.size))
        for i, j in combinations(range(x.size), 2):
            if hypot(x[i] - x[j], y[i] - y[j]) < reach:
                low, high = sorted((name[i], name[j]))
                name = [low if one == high else one for one in name]
        alone = {one for one in name if name.count(one) == 1}
        assert frame["flocks"] == [ALONE if one in alone else one for one in name]
        sizes |= {name.count(one) for one in name}
    assert len(sizes) > 2


@pytest.mark.parametrize("case", [CASES[1], CASES[3]], ids=MODEL, indirect=True)
def test_a_recording_tells_what_was_visited(
    case: tuple[Told, ViewState],
) -> None:
    """Those of its places exactly; and nearly those that the kernels count, which know
    places better.
    """
    found, state = case
    simulation = simulation_of(state.job, recorded(state.job, (), visits=True))
    pixels = looking.pixels(simulation)
    blocked = looking.visits(simulation) < 0
    counts, room = np.zeros(blocked.shape, int), int(pixels.radius) + 2
    assert found.told["places"] == [0, 0, 16, 17, 30]
    for place, (x, y) in enumerate(found.places):
        for across, along in zip(
            x * pixels.per_length, y * pixels.per_length, strict=True
        ):
            if pixels.truncated:
                across, along = np.trunc(across), np.trunc(along)
            left, top = max(0, int(across) - room), max(0, int(along) - room)
            there = counts[top : int(along) + room, left : int(across) + room]
            rows, columns = np.indices(there.shape)
            near = np.hypot(columns + left - across, rows + top - along)
            there += (near <= pixels.radius) & (place > 0)
        if place in (23, 30):
            told_now = np.array(found.told["before" if place == 23 else "last"])
            shown = np.where(blocked, 255, np.where(counts > 0, 254, 0))
            assert (told_now.reshape(blocked.shape) == shown).all()
    for _ in range(30):
        simulation.advance(1)
        simulation.take_frames()
    exact = looking.visits(simulation)
    assert (exact > 0).sum() > 500
    assert (exact != np.where(blocked, -1, counts)).sum() < 0.05 * (exact > 0).sum()


def test_a_boid_that_rests_sees_all_round_or_where_it_last_flew() -> None:
    """A swarm that is held: one model's boids look on, another's see all round."""
    still = {"steps": 3, "n": 6, "fov": 90.0}
    for model, preset, all_round in (
        ("aziel_chen2025", "as_run", True),
        ("rustamani2024", "as_run", False),
    ):
        state = begin(model, preset).with_settings(still)
        flight = fly("a/study", state.job, state.plots)
        bodies = flight.bodies.copy()
        bodies[1:3, 2:, 4] = 0.0
        said = {one["type"]: one for one in Live(state).greeting()}
        run = recorded_run(flight._replace(bodies=bodies), said, "")
        resting = base64.b64decode(run["senses"]["resting"])
        bits = np.unpackbits(np.frombuffer(resting, np.uint8), bitorder="little")
        assert np.flatnonzero(bits).tolist() == ([10, 16] if all_round else [])
        content = frames_of(run)
        size = len(content) // 4
        headings = [content[at * size + HEAD.size + 4 * 6 + 4] for at in range(4)]
        before, first, second, after = headings
        assert (first, second) == ((0, 0) if all_round else (before, before))
        assert {before, after} != {0}
    assert [b - a for a, b in pairwise(run["steps"])] == [1, 1, 1]
