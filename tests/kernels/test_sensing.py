"""What boids know of each other and of themselves: errors and delays against closed
forms, and who hears whom.

Random numbers have fixed keys. Statistical checks are two-sided at Z standard errors: a
check of a normal number fails by chance once in 147,000 keys, and there are about 120.
"""

import math
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from kernels.chance import ChanceKey
from kernels.near import EVERYBODY, build_near
from kernels.neighbours import ALL_ROUND, all_pairs, search
from kernels.occupancy import no_occupancy
from kernels.polygons import is_polygon, meets_polygon
from kernels.robots.hearing import hears
from kernels.robots.occlusion import meets_disc, meets_rectangle, way_between
from kernels.robots.robots import NO_KEYS, build_robots
from kernels.robots.senses import (
    NEVER,
    Senses,
    build_senses,
    error_law,
    is_ideal,
    never,
)
from kernels.robots.sensing import others_of, own_of, publish
from kernels.settings import OPEN, TORUS
from kernels.shapes import Obstacle, Polygon, boxes_of, corners_of
from kernels.state import Flock, World, laid_out
from kernels.workspace import Workspace, build_workspace
from kernels.worlds import build_reach
from tests import builders
from tests.interpreter import interpreted

KEY, DT, Z = ChanceKey(17, 4), 0.5, 4.5
NOISE = {"position_noise": 2.0, "velocity_noise": 0.3, "noise_time": 4.0}
FORMS = {
    "white": NOISE | {"noise_time": 0.0},
    "correlated": NOISE,
    "underdamped": NOISE | {"noise_form": "coupled", "velocity_noise": 1.1},
    "overdamped": NOISE | {"noise_form": "coupled", "noise_time": 1.0},
}


def aware(
    flock: Flock,
    world: World | None = None,
    *,
    silent: dict[int, int] | None = None,
    blind: dict[int, int] | None = None,
    search_range: float = math.inf,
    **changes: Any,
) -> Workspace:
    """What boids with such senses work with, in steps of DT. Boids are silent or blind
    from steps on.
    """
    n, world = flock.x.size, world or builders.a_world()
    steps = never(n), never(n)
    for array, failing in zip(steps, (silent, blind), strict=True):
        for boid, step in (failing or {}).items():
            array[boid] = step
    sensing = builders.a_sensing(**changes)
    senses = build_senses(sensing, n, DT, world, KEY, *steps)
    return build_workspace(
        flock,
        world,
        search_range,
        EVERYBODY,
        build_reach(world, 0.0),
        no_occupancy(),
        np.zeros((0, n)),
        np.zeros(n, np.int64),
        build_robots(builders.robots(), NO_KEYS, n, DT, world),
        senses,
    )


def senses_of(work: Workspace) -> Senses:
    assert work.near.senses is not None
    return work.near.senses


def at_rest(n: int) -> Flock:
    return laid_out(builders.a_flock(*np.zeros((4, n))))


def someone(n: int, seed: int = 0) -> Flock:
    """Boids at random places in the world, with random velocities."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 800, n), rng.uniform(0, 600, n)
    return builders.a_flock(x, y, *rng.normal(0, 3, (2, n)))


def four(flock: Flock) -> np.ndarray:
    """x, y, vx and vy, in an array of their own."""
    return np.stack(flock[:4])


def step(flock: Flock, work: Workspace) -> np.ndarray:
    """What boids know of others in the next step."""
    others = others_of(flock, work, False)
    publish(flock, others, work)
    return four(others)


def found_by(flock: Flock, world: World, work: Workspace, i: int) -> list[int]:
    """The boids that boid `i` hears of, among all."""
    others, near = others_of(flock, work, False), work.near
    found = search(others, world, work.grid, i, math.inf, ALL_ROUND, 0.0, 0.0, near)
    return near.boid[:found].tolist()


# ---- errors of measurement


def covariance(form: str, lag: float) -> np.ndarray:
    """E[(q, u)(t + lag) (q, u)(t)'] of an error q and its velocity's error u, from
    textbooks: exp(-lag / noise_time) of Ornstein and Uhlenbeck for independent ones,
    and the Green's function of a damped oscillator for coupled ones.
    """
    given = FORMS[form]
    time, q2, u2 = (
        given["noise_time"],
        given["position_noise"] ** 2,
        given["velocity_noise"] ** 2,
    )
    if "noise_form" not in given:
        kept = math.exp(-lag / time) if time > 0.0 else float(lag == 0.0)
        return np.diag([kept * q2, kept * u2])
    rate = 0.5 / time
    square = u2 / q2 - rate * rate
    root = math.sqrt(abs(square))
    even = (math.cos if square > 0 else math.cosh)(root * lag)
    odd = (math.sin if square > 0 else math.sinh)(root * lag) / root
    moved = np.array([[even + rate * odd, odd], [-u2 / q2 * odd, even - rate * odd]])
    return math.exp(-rate * lag) * moved @ np.diag([q2, u2])


@pytest.mark.parametrize("form", FORMS)
def test_errors_have_their_covariance_from_the_first_step_on(form: str) -> None:
    """At steps 0, 1, 7 and 60, and between them. In 40,000 coordinates the standard
    error of a covariance of normal numbers is the root of (a b + c^2) / 40,000, with
    the variances a and b and the covariance c.
    """
    n, looked = 20_000, (0, 1, 7, 60)
    flock = at_rest(n)
    work, kept = aware(flock, **FORMS[form]), {}
    for k in range(max(looked) + 1):
        known = step(flock, work)
        kept[k] = known.reshape(2, 2 * n)
    still = covariance(form, 0.0)
    for late in looked:
        for early in (one for one in looked if one <= late):
            wanted = covariance(form, (late - early) * DT)
            found = kept[late] @ kept[early].T / (2 * n)
            error = np.sqrt(np.outer(np.diag(still), np.diag(still)) + wanted**2)
            assert (np.abs(found - wanted) < Z * error / math.sqrt(2 * n)).all()


@pytest.mark.parametrize("time", [0.0, 10.0])
def test_the_form_of_errors_is_nothing_where_there_are_none(time: float) -> None:
    """As where an ablation takes away the noise and leaves the form."""
    sensing = builders.a_sensing(noise_form="coupled", noise_time=time)
    law = error_law(sensing, 0.5)
    assert law.is_none
    assert law.from_q == law.across == law.from_u == 0.0


@pytest.mark.parametrize("dt", [1e-3, 0.5, 20.0])
@pytest.mark.parametrize("form", FORMS)
def test_the_law_of_errors_keeps_their_variance_at_any_step(
    form: str, dt: float
) -> None:
    """M S M' + L L' = S, and M S is the covariance after dt. Both are off by rounding:
    1e-13 of the largest entry; the least number that noise adds is a difference of
    numbers that are 1e9 times as large.
    """
    law = error_law(builders.a_sensing(**FORMS[form]), dt)
    m = np.array([[law.qq, law.qu], [law.uq, law.uu]])
    lower = np.array([[law.from_q, 0.0], [law.across, law.from_u]])
    still = covariance(form, 0.0)
    most = still.max()
    np.testing.assert_allclose(
        m @ still @ m.T + lower @ lower.T, still, rtol=0, atol=1e-13 * most
    )
    np.testing.assert_allclose(
        m @ still, covariance(form, dt), rtol=0, atol=1e-13 * most
    )


def exact_law(form: dict[str, Any], dt: float) -> list[float]:
    """from_q, across and from_u of coupled errors by S - M S M' with 80 digits, M by
    its series, scaled and squared.
    """
    with localcontext(prec=80):
        place, pace, time, step = map(
            Decimal,
            (form["position_noise"], form["velocity_noise"], form["noise_time"], dt),
        )
        spring = (pace / place) ** 2
        small = np.array([[Decimal(0), step], [-spring * step, -step / time]]) / 2**40
        moved = term = np.array([[Decimal(1), Decimal(0)], [Decimal(0), Decimal(1)]])
        for n in range(1, 12):
            term = term @ small / n
            moved = moved + term
        for _ in range(40):
            moved = moved @ moved
        still = np.array([[place * place, Decimal(0)], [Decimal(0), pace * pace]])
        added = still - moved @ still @ moved.T
        from_q = added[0, 0].sqrt()
        across = added[0, 1] / from_q
        from_u = (added[1, 1] - across * across).sqrt()
        return [float(one) for one in (from_q, across, from_u)]


@pytest.mark.parametrize("dt", [1e-6, 1e-3, 0.05, 0.5, 3.0, 20.0])
@pytest.mark.parametrize("form", ["underdamped", "overdamped"])
def test_coupled_errors_keep_their_digits_in_short_and_long_steps(
    form: str, dt: float
) -> None:
    """To 1e-13 of the largest: some 100 roundings. S - M S M' with 16 digits has none
    left of from_q at 1e-6.
    """
    law = error_law(builders.a_sensing(**FORMS[form]), dt)
    found = np.array([law.from_q, law.across, law.from_u])
    wanted = np.array(exact_law(FORMS[form], dt))
    scale = np.array([wanted[0], *[max(abs(wanted[1:]))] * 2])
    np.testing.assert_array_less(np.abs(found - wanted), 1e-13 * scale)


def test_what_a_boid_knows_of_itself_has_errors_as_wanted() -> None:
    """None; those that others see, to the bit; or others of the same variance, whose
    correlation with those is 0 at Z standard errors.
    """
    n = 20_000
    known = {}
    for own_noise in ("none", "shared", "independent"):
        flock = at_rest(n)
        work = aware(flock, own_noise=own_noise, **NOISE)
        for _ in range(3):
            sent = step(flock, work)
        known[own_noise] = four(own_of(flock, work))
    assert (known["none"] == 0.0).all()
    assert (known["shared"] == sent).all()
    own = known["independent"].reshape(2, 2 * n)
    sent = sent.reshape(2, 2 * n)
    scale = np.array([[NOISE["position_noise"]], [NOISE["velocity_noise"]]])
    root = math.sqrt(2 * n)
    variance = ((own / scale) ** 2).mean(axis=1)
    assert (np.abs(variance - 1) < Z * math.sqrt(2.0) / root).all()
    assert (np.abs((own / scale * sent / scale).mean(axis=1)) < Z / root).all()


# ---- delays and samples


@pytest.mark.parametrize("begun", [0, 5])
@pytest.mark.parametrize(("delay", "period"), [(0, 1), (3, 1), (0, 4), (3, 4), (5, 2)])
def test_boids_know_what_others_were_so_long_ago(
    delay: int, period: int, begun: int
) -> None:
    """To the bit: at sample k what was sent `delay` before, and until the next sample
    no other; in the first steps what was sent at the start. Of itself each knows what
    it is now. Senses may begin in any step of a flight, and k counts from there.
    """
    flock = someone(7)
    work = aware(
        flock,
        sensing_delay=delay * DT,
        sensing_period=period * DT,
        radio_range=1e9,
    )
    states = []
    work.robots.clock[0] = begun
    for k in range(25):
        for row, other in zip(flock[:4], someone(7, k)[:4], strict=True):
            row[:] = other
        states.append(four(flock))
        sampled = k - k % period
        assert (step(flock, work) == states[max(sampled - delay, 0)]).all()
        assert (four(own_of(flock, work)) == states[k]).all()
        assert (np.stack(flock[4:]) == states[k][2:]).all()
        assert work.robots.clock[0] == begun + k + 1


# ---- who hears whom


def test_packets_are_lost_as_often_as_wanted() -> None:
    """The number of lost packets at four distances, of which the last one loses all;
    and the same at any distance where packet_loss_range is infinite. The standard error
    of a share p of m is the root of p (1 - p) / m.
    """
    ring, steps, loss = 40, 500, 0.4
    angle = np.arange(ring) * math.tau / ring
    for distance in (20.0, 50.0, 90.0, 130.0):
        x = np.append(distance * np.cos(angle), 0.0)
        y = np.append(distance * np.sin(angle), 0.0)
        for scale in (80.0, math.inf):
            flock = builders.a_flock(x, y, *np.zeros((2, ring + 1)))
            work = aware(flock, packet_loss=loss, packet_loss_range=scale)
            heard = 0
            for _ in range(steps):
                step(flock, work)
                heard += len(found_by(flock, builders.a_world(), work, ring))
            share = 1.0 - heard / (ring * steps)
            p = loss if scale == math.inf else min(1.0, loss * (distance / scale) ** 2)
            error = math.sqrt(p * (1.0 - p) / (ring * steps))
            assert abs(share - p) <= Z * error


@pytest.mark.parametrize("minimum_image", [False, True])
def test_the_same_boids_are_heard_however_they_are_looked_for(
    minimum_image: bool,
) -> None:
    """With a grid of what was sent and among all, in any order of search; and the grid
    is read, as lists are short. Of losses, delays, errors, and of obstacles.
    """
    world = builders.a_world(800.0, 600.0, TORUS, minimum_image)
    senses = {
        "packet_loss": 0.5,
        "packet_loss_range": 60.0,
        "sensing_delay": 3 * DT,
        "own_noise": "independent",
        "occlusion": "boids",
        "body_radius": 2.0,
    }
    flock = someone(300)
    work = aware(flock, world, search_range=50.0, **senses, **NOISE)
    assert not work.grid.everyone
    for _ in range(8):
        step(flock, work)
        flock.x[:] = (flock.x + flock.vx * 5.0) % 800.0
        flock.y[:] = (flock.y + flock.vy * 5.0) % 600.0
    others = others_of(flock, work, False)
    heard = []
    for grid, order in ((work.grid, 1), (all_pairs(300), 1), (work.grid, -1)):
        found = {}
        for i in range(300)[::order]:
            count = search(
                others, world, grid, i, 2500.0, ALL_ROUND, 0.0, 0.0, work.near
            )
            ways = np.stack([work.near.dx[:count], work.near.dy[:count]])
            found[i] = work.near.boid[:count].tolist(), ways.tobytes()
        heard.append(found)
    assert heard[0] == heard[1] == heard[2]
    assert sum(len(boids) for boids, _ in heard[0].values()) > 300


def test_a_boid_hears_up_to_its_radio_range_of_where_others_truly_are() -> None:
    """At exactly the range too, whatever was measured. Errors of 2 px would make 100 px
    more or less in half of the steps.
    """
    x = np.array([0.0, 100.0, 100.000001])
    flock = builders.a_flock(x, *np.zeros((3, 3)))
    work = aware(flock, radio_range=100.0, **NOISE)
    for _ in range(20):
        step(flock, work)
        assert found_by(flock, builders.a_world(), work, 0) == [1]


def test_silent_boids_are_not_heard_of_and_blind_ones_hear_of_nobody() -> None:
    """From the step on. What a silent boid has sent before still arrives."""
    flock = someone(4)
    delay = {"sensing_delay": 2 * DT}
    work = aware(flock, silent={1: 3}, blind={2: 4}, **delay)
    for k in range(8):
        step(flock, work)
        heard = [found_by(flock, builders.a_world(), work, i) for i in range(4)]
        speaking = [j for j in range(4) if j != 1 or k - 2 < 3]
        for i in range(4):
            wanted = [j for j in speaking if j != i]
            assert heard[i] == ([] if i == 2 and k >= 4 else wanted), (k, i)


def test_ideal_boids_have_no_senses() -> None:
    """And a step of them costs nothing: kernels are compiled without senses. What has
    no effect alone makes none either.
    """
    world = builders.a_world()
    for changes in (
        {},
        {"body_radius": 5.0},
        {"noise_time": 2.0},
        {"sensing_period": DT},
    ):
        ideal = builders.a_sensing(**changes)
        assert is_ideal(ideal, DT)
        assert build_senses(ideal, 5, DT, world, KEY, never(5), never(5)) is None
    some = never(5)
    some[2] = 0
    sensing = builders.a_sensing()
    assert build_senses(sensing, 5, DT, world, KEY, some, never(5)) is not None
    assert NEVER > 10**9


# ---- what hides


def hidden_pairs(flock: Flock, world: World, **changes: Any) -> set[tuple[int, int]]:
    """The ordered pairs of which the first does not hear of the second."""
    work = aware(flock, world, **changes)
    step(flock, work)
    n = flock.x.size
    return {
        (i, j)
        for i in range(n)
        for j in range(n)
        if i != j and not hears(senses_of(work), world, i, j)
    }


def test_of_three_in_a_row_the_middle_one_hides_the_others_from_each_other() -> None:
    """As long as it is less than its radius off the way between them; and a boid behind
    hides nobody.
    """
    for off, hides in ((0.0, True), (1.9, True), (2.1, False), (-1.9, True)):
        x, y = np.array([10.0, 40.0, 80.0]), np.array([50.0, 50.0 + off, 50.0])
        flock = builders.a_flock(x, y, *np.zeros((2, 3)))
        found = hidden_pairs(
            flock, builders.a_world(), occlusion="boids", body_radius=2.0
        )
        # From the first to the second the way is oblique, and the third is behind it.
        assert found == ({(0, 2), (2, 0)} if hides else set())


@pytest.mark.parametrize("minimum_image", [False, True])
@pytest.mark.parametrize("radius", [2.0, 15.0])
def test_bodies_hide_as_if_each_were_looked_at(
    minimum_image: bool, radius: float
) -> None:
    """A search looks only at bodies within reach: in the interpreter and compiled it
    finds those that a look at all bodies, one by one, leaves.
    """
    borders = TORUS if minimum_image else OPEN
    world = builders.a_world(borders=borders, minimum_image=minimum_image)
    flock = someone(60, seed=4)
    work = aware(flock, world, occlusion="boids", body_radius=radius)
    step(flock, work)
    senses, hidden = senses_of(work), 0
    for i in range(60):
        ways = [way_between(senses, world, i, j) for j in range(60)]
        seen = []
        for j in set(range(60)) - {i}:
            dx, dy = ways[j]
            length2 = dx * dx + dy * dy
            between = (
                0 < x * dx + y * dy < length2
                and (x * dy - y * dx) ** 2 < radius * radius * length2
                for m, (x, y) in enumerate(ways)
                if m not in (i, j)
            )
            if not any(between):
                seen.append(j)
        assert found_by(flock, world, work, i) == seen
        assert [j for j in range(60) if j != i and hears(senses, world, i, j)] == seen
        hidden += 59 - len(seen)
    assert hidden > 100


HOOK = (0.0, 0.0), (80.0, 0.0), (80.0, 80.0), (60.0, 80.0), (60.0, 20.0), (0.0, 20.0)


def obstacles_of_all_kinds(arena: bool) -> tuple[Obstacle, ...]:
    """Discs, rectangles and hooks at random places in the world, which they leave in
    parts, and an arena in the middle of it.
    """
    rng = np.random.default_rng(8)
    found: list[Obstacle] = []
    for k in range(12):
        x, y = rng.uniform(0, 800), rng.uniform(0, 600)
        if k % 3 == 2:
            found.append(Polygon(tuple((x + a, y + b) for a, b in HOOK)))
        else:
            found.append((x, y, *rng.uniform(5, 40, 2), float(k % 3)))
    corners = (30.0, 20.0), (780.0, 30.0), (770.0, 580.0), (20.0, 560.0)
    return (*found, Polygon(corners, is_arena=True)) if arena else tuple(found)


def is_met(world: World, m: int, way: tuple[float, float, float, float]) -> bool:
    """Whether the way (dx, dy) from (x, y) leads through obstacle `m`."""
    x, y, dx, dy = way
    if world.corners is not None and is_polygon(world.corners, m):
        return meets_polygon(world.corners, m, x, y, dx, dy)
    to_x, to_y = world.obstacle_x[m] - x, world.obstacle_y[m] - y
    width, height = world.half_width[m], world.half_height[m]
    if world.is_round[m]:
        return meets_disc(dx, dy, to_x, to_y, width)
    return meets_rectangle(dx, dy, to_x, to_y, width, height)


WAYS = [(False, False), (False, True), (True, False)]


@pytest.mark.slow
@pytest.mark.parametrize(("minimum_image", "arena"), WAYS)
def test_obstacles_hide_as_if_each_were_looked_at(
    minimum_image: bool, arena: bool
) -> None:
    """A search looks only at obstacles within reach, and at polygons only whose
    rectangle is on the way: it finds those that a look at all obstacles leaves, and at
    all that are beyond the borders of a torus. Some boids are in obstacles, and some
    are outside of the arena and of the world.
    """
    borders = TORUS if minimum_image else OPEN
    shapes = obstacles_of_all_kinds(arena)
    world = builders.a_world(
        borders=borders,
        minimum_image=minimum_image,
        obstacles=boxes_of(shapes, 800.0, 600.0),
    )._replace(corners=corners_of(shapes))
    n = 24
    flock = someone(n, seed=4)
    if arena:
        flock.x[:], flock.y[:] = 1.2 * flock.x - 80.0, 1.2 * flock.y - 60.0
    work = aware(flock, world, occlusion="obstacles")
    step(flock, work)
    senses, hidden = senses_of(work), 0
    images = [
        (across, along)
        for across in ((-800.0, 0.0, 800.0) if minimum_image else (0.0,))
        for along in ((-600.0, 0.0, 600.0) if minimum_image else (0.0,))
    ]
    for i in range(n):
        x, y = flock.x[i], flock.y[i]
        seen = [
            j
            for j in set(range(n)) - {i}
            if not any(
                is_met(world, m, (x - a, y - b, *way_between(senses, world, i, j)))
                for m in range(len(shapes))
                for a, b in images
            )
        ]
        assert found_by(flock, world, work, i) == seen
        assert [j for j in range(n) if j != i and hears(senses, world, i, j)] == seen
        hidden += n - 1 - len(seen)
    assert 0.2 < hidden / (n * (n - 1)) < 0.93


@pytest.mark.parametrize(("minimum_image", "arena"), WAYS)
def test_they_do_in_the_interpreter(minimum_image: bool, arena: bool) -> None:
    """Where nothing has to be compiled for senses among polygons."""
    interpreted(
        "from tests.kernels import test_sensing as t\n"
        f"t.test_obstacles_hide_as_if_each_were_looked_at({minimum_image}, {arena})"
    )


def test_an_obstacle_hides_those_behind_it() -> None:
    """A disc and a rectangle, and not those beside them; across the border of a torus
    the way leads elsewhere, past another obstacle.
    """
    obstacles = np.array(
        [[100.0, 300.0, 20.0, 20.0, 1.0], [700.0, 300.0, 5.0, 40.0, 0.0]]
    )
    x, y = np.array([50.0, 150.0, 650.0, 750.0]), np.full(4, 300.0)
    flock = builders.a_flock(x, y, *np.zeros((2, 4)))
    world = builders.a_world(obstacles=obstacles)
    straight = {(0, 1), (0, 2), (0, 3), (1, 3), (2, 3)}
    assert hidden_pairs(flock, world, occlusion="obstacles") == straight | {
        (j, i) for i, j in straight
    }
    around = builders.a_world(800.0, 600.0, TORUS, True, obstacles=obstacles)
    short = {(0, 1), (0, 2), (1, 2), (1, 3), (2, 3)}
    assert hidden_pairs(flock, around, occlusion="obstacles") == short | {
        (j, i) for i, j in short
    }


coordinates = st.floats(-100.0, 100.0, allow_subnormal=False)
sizes = st.floats(1.0, 50.0)


@given(coordinates, coordinates, coordinates, coordinates, sizes, sizes)
def test_a_way_meets_what_its_points_are_in(
    dx: float, dy: float, x: float, y: float, half_width: float, half_height: float
) -> None:
    """Of 2001 points on the way some is in the shape, made smaller by less than the way
    between two points; or none, with the shape larger by that.
    """
    share = np.linspace(0.0, 1.0, 2001)
    off_x, off_y = np.abs(share * dx - x), np.abs(share * dy - y)
    slack = math.hypot(dx, dy) / 2000 + 1e-9
    for meets, depth in (
        (
            meets_rectangle(dx, dy, x, y, half_width, half_height),
            np.minimum(half_width - off_x, half_height - off_y).max(),
        ),
        (
            meets_disc(dx, dy, x, y, half_width),
            (half_width - np.hypot(off_x, off_y)).max(),
        ),
    ):
        if abs(depth) > slack:
            assert meets == (depth > 0)


def test_room_for_neighbours_has_the_senses_that_it_is_given() -> None:
    flock = someone(3)
    senses = senses_of(aware(flock, packet_loss=1.0))
    assert build_near(3, senses=senses).senses is senses
    assert build_near(3).senses is None
