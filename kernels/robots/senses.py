"""What a flight keeps of the senses of its boids: settings, errors, messages."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.chance import ChanceKey
from kernels.elementary import cos, exp, expm1, sin
from kernels.settings import (
    COUPLED,
    HIDDEN_BY_BOIDS,
    HIDDEN_BY_BOTH,
    HIDDEN_BY_OBSTACLES,
    NO_OWN_NOISE,
    NOTHING_HIDES,
    OWN_SHARED,
    Sensing,
)
from kernels.state import Floats, Flock, World, empty_flock, laid_out

NEVER = np.iinfo(np.int64).max
"""The step in which what does not happen happens."""
NOT_BEGUN = -1
NODES = (
    *(0.14887433898163122, 0.4333953941292472, 0.6794095682990244),
    *(0.8650633666889845, 0.9739065285171717),
)
WEIGHTS = (
    *(0.29552422471475287, 0.26926671930999635, 0.21908636251598204),
    *(0.1494513491505806, 0.06667134430868814),
)
"""Of the Gauss-Legendre rule with ten nodes, half of them: the others have the other
sign. It integrates a kick of a spring to rounding.
"""
SINCE, NOW, SAMPLED, SENT = range(4)
"""Places in the times of Senses."""


class ErrorLaw(NamedTuple):
    """How the error (q, u) of a measured coordinate and of its velocity changes in a
    step: (q, u) <- M (q, u) + L g, with g two independent standard normal numbers.

    M is (qq, qu; uq, uu), and L the lower triangle (from_q, 0; across, from_u). With
    the standard deviations `position` and `velocity`, q and u independent, the errors
    are stationary from the start on. `is_none` says that both are 0.
    """

    is_none: bool
    position: float
    velocity: float
    qq: float
    qu: float
    uq: float
    uu: float
    from_q: float
    across: float
    from_u: float


class Senses(NamedTuple):
    """What boids know, and of whom they hear; see kernels.robots.sensing.

    `own` is what each knows of itself. `messages` (D + 1, 4, N) are x, y, vx and vy
    that each has measured in the last steps, for a `delay` of D steps. `errors` (4, N)
    are those of x, y, vx and vy that others see, `own_errors` (4, N) those that the
    boid has itself. `place` (2, N) is where all were when others were last sampled,
    which is done every `period` steps. `bodies` (2, N) is room for the ways to those
    that may hide others from one boid; it is (2, 0) where bodies hide nobody. `hiding`
    (R,) and `shift` (2, R) are such room for obstacles, R for all that can be.

    `times` (4,) are steps, counted from 0: in which these senses begin, NOT_BEGUN
    before; the step that is taken; that of the last sample; and that in which was sent
    what is known since.

    A boid whose number i is in no message from step `silent_from[i]` on; from
    `blind_from[i]` on it knows of nobody.
    """

    own: Flock
    messages: Floats
    errors: Floats
    own_errors: Floats
    place: Floats
    bodies: Floats
    hiding: NDArray[np.int64]
    shift: Floats
    times: NDArray[np.int64]
    silent_from: NDArray[np.int64]
    blind_from: NDArray[np.int64]
    key: ChanceKey
    law: ErrorLaw
    knows_itself: bool
    shares_errors: bool
    delay: int
    period: int
    radio_range: float
    packet_loss: float
    packet_loss_range: float
    obstacles_hide: bool
    boids_hide: bool
    body_radius: float


def never(n: int) -> NDArray[np.int64]:
    """The steps (N,) of what happens to none of `n` boids."""
    return np.full(n, NEVER)


def is_ideal(sensing: Sensing, dt: float) -> bool:
    """Whether boids know exactly and at once what they see, in steps of `dt`."""
    return (
        sensing.position_noise == 0.0
        and sensing.velocity_noise == 0.0
        and steps_of(sensing.sensing_delay, dt) == 0
        and steps_of(sensing.sensing_period, dt) <= 1
        and sensing.radio_range == math.inf
        and sensing.packet_loss == 0.0
        and sensing.occlusion == NOTHING_HIDES
    )


def steps_of(time: float, dt: float) -> int:
    """How many steps of `dt` a time is, which is a whole number of them."""
    return round(time / dt)


def build_senses(
    sensing: Sensing,
    n: int,
    dt: float,
    world: World,
    key: ChanceKey,
    silent_from: NDArray[np.int64],
    blind_from: NDArray[np.int64],
) -> Senses | None:
    """The senses of `n` boids at the start of a flight in steps of `dt`, of which these
    are silent and blind from those steps (N,) on. None where boids know all that they
    see: then kernels are compiled without any of this.
    """
    all_well = min(silent_from.min(), blind_from.min()) == NEVER
    if is_ideal(sensing, dt) and all_well:
        return None
    delay = steps_of(sensing.sensing_delay, dt)
    boids_hide = sensing.occlusion in (HIDDEN_BY_BOIDS, HIDDEN_BY_BOTH)
    obstacles_hide = sensing.occlusion in (HIDDEN_BY_OBSTACLES, HIDDEN_BY_BOTH)
    images = 9 if world.minimum_image else 1
    hiding = images * world.obstacle_x.size if obstacles_hide else 0
    return Senses(
        laid_out(empty_flock(n)),
        np.zeros((delay + 1, 4, n)),
        np.zeros((4, n)),
        np.zeros((4, n)),
        np.zeros((2, n)),
        np.zeros((2, n if boids_hide else 0)),
        np.zeros(hiding, np.int64),
        np.zeros((2, hiding)),
        np.full(4, NOT_BEGUN),
        silent_from,
        blind_from,
        key,
        error_law(sensing, dt),
        sensing.own_noise == NO_OWN_NOISE,
        sensing.own_noise == OWN_SHARED,
        delay,
        max(1, steps_of(sensing.sensing_period, dt)),
        sensing.radio_range,
        sensing.packet_loss,
        sensing.packet_loss_range,
        obstacles_hide,
        boids_hide,
        sensing.body_radius,
    )


def go_on_with(mine: Senses | None, earlier: Senses | None) -> bool:
    """Let senses go on where `earlier` ones of as many boids are, if they remember the
    same; else they begin anew in the next step. Whether they go on.
    """
    if mine is None or earlier is None:
        return False
    if (mine.law, mine.delay) != (earlier.law, earlier.delay):
        return False
    for here, there in zip(mine.own, earlier.own, strict=True):
        here[:] = there
    mine.messages[:], mine.place[:] = earlier.messages, earlier.place
    mine.errors[:], mine.own_errors[:] = earlier.errors, earlier.own_errors
    mine.times[:] = earlier.times
    return True


def error_law(sensing: Sensing, dt: float) -> ErrorLaw:
    """The law of the errors of measurement in steps of `dt`.

    Independent errors are AR(1) with the correlation exp(-dt / noise_time). Coupled
    ones are the exact solution of dq = u dt, du = -(u / noise_time) dt - k q dt + noise
    with k = (velocity_noise / position_noise)^2, a damped spring driven by white noise
    (Uhlenbeck and Ornstein 1930, On the theory of the Brownian motion, Physical Review
    36, 823-841, section IV). With the stationary covariance S = diag(position_noise^2,
    velocity_noise^2) and M the exponential of the matrix of the equations times dt, the
    covariance of what noise adds is S - M S M', so that S stays for any dt.
    """
    place, pace, time = (
        sensing.position_noise,
        sensing.velocity_noise,
        sensing.noise_time,
    )
    is_none = place == 0.0 and pace == 0.0
    if sensing.noise_form == COUPLED and not is_none:
        k = (pace / place) * (pace / place)
        qq, qu, uq, uu = _spring(time, k, dt)
        scale = 2.0 * pace * pace / time
        var_q, cross, var_u = (scale * one for one in _kicks(time, k, dt))
    else:
        qq = uu = exp(-dt / time) if time > 0.0 else 0.0
        qu = uq = cross = 0.0
        fresh = -expm1(-2.0 * dt / time) if time > 0.0 else 1.0
        var_q, var_u = fresh * place * place, fresh * pace * pace
    from_q = math.sqrt(var_q)
    across = cross / from_q if from_q > 0.0 else 0.0
    from_u = math.sqrt(max(var_u - across * across, 0.0))
    return ErrorLaw(is_none, place, pace, qq, qu, uq, uu, from_q, across, from_u)


def _spring(time: float, k: float, dt: float) -> tuple[float, float, float, float]:
    """The matrix exponential of (0, 1; -k, -1 / time) times `dt`, row by row."""
    rate = 0.5 / time
    square = rate * rate - k
    root = math.sqrt(abs(square))
    if square > 0.0:
        slow, fast = exp(-k / (root + rate) * dt), exp(-(root + rate) * dt)
        even, odd = 0.5 * (slow + fast), -0.5 * slow * expm1(-2 * root * dt) / root
    else:
        even = odd = exp(-rate * dt)
        even *= cos(root * dt)
        odd *= sin(root * dt) / root if root > 0.0 else dt
    return even + rate * odd, odd, -k * odd, even - rate * odd


def _kicks(time: float, k: float, dt: float) -> tuple[float, float, float]:
    """The variance of q, the covariance and the variance of u that white noise of u
    adds in `dt`: the integral of the outer product of what a kick of u becomes, the
    second column of `_spring`.

    S - M S M' says the same, but loses nearly all digits where dt is short: there the
    part of q is of the order of dt^3. So the integral is computed over a part of dt in
    which the spring has hardly moved, and then doubled as often as needed, by sums
    alone: that of 2 t is Q(t) + M(t) Q(t) M(t)'. There are sums of Python only, because
    the order of NumPy's depends on the processor.
    """
    fastest = max(1.0 / time, math.sqrt(k))
    doublings = max(0, math.frexp(fastest * dt)[1])
    part = math.ldexp(dt, -doublings)
    var_q, cross, var_u = 0.0, 0.0, 0.0
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        for at in (-node, node):
            _, q, _, u = _spring(time, k, 0.5 * part * (1.0 + at))
            share = 0.5 * part * weight
            var_q += share * q * q
            cross += share * q * u
            var_u += share * u * u
    for n in range(doublings):
        qq, qu, uq, uu = _spring(time, k, math.ldexp(part, n))
        row_q, row_u = qq * var_q + qu * cross, qq * cross + qu * var_u
        var_u += (uq * var_q + uu * cross) * uq + (uq * cross + uu * var_u) * uu
        cross += row_q * uq + row_u * uu
        var_q += row_q * qq + row_u * qu
    return var_q, cross, var_u
