"""Sensing model of a flock during a trial: parameters, errors, messages."""

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
"""Step of an event that does not happen."""
NOT_BEGUN = -1
NODES = (
    *(0.14887433898163122, 0.4333953941292472, 0.6794095682990244),
    *(0.8650633666889845, 0.9739065285171717),
)
WEIGHTS = (
    *(0.29552422471475287, 0.26926671930999635, 0.21908636251598204),
    *(0.1494513491505806, 0.06667134430868814),
)
"""Half of the Gauss-Legendre rule with ten nodes; the other half has negative nodes.

The rule integrates the response of the spring to a kick up to rounding errors.
"""
SINCE, NOW, SAMPLED, SENT = range(4)
"""Indices into the `times` of Senses."""


class ErrorLaw(NamedTuple):
    """Change in a step of the error of a coordinate and of its velocity.

    The errors (q, u) become M (q, u) + L g, with g two independent standard normal
    numbers. At the start, q and u are independent, with the standard deviations
    `position` and `velocity`. So the errors are stationary from the start.

    Attributes
    ----------
    is_none : bool
        Whether both standard deviations are 0.
    position, velocity : float
        Standard deviations of q and u.
    qq, qu, uq, uu : float
        The matrix M, row by row.
    from_q, across, from_u : float
        The lower triangle L, (from_q, 0; across, from_u).
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
    """State and parameters of the sensing of N boids; see kernels.robots.sensing.

    Attributes
    ----------
    own : Flock
        Knowledge of each boid about itself.
    messages : array of float, shape (D + 1, 4, N)
        x, y, vx and vy that each boid has measured in the last steps, for a `delay` of
        D steps.
    errors, own_errors : array of float, shape (4, N)
        Errors of x, y, vx and vy: in messages, and in the knowledge of a boid about
        itself.
    place : array of float, shape (2, N)
        True positions at the last sample.
    bodies : array of float, shape (2, N)
        Memory for the displacements to bodies that may hide boids from one boid; (2, 0)
        if bodies do not hide boids.
    hiding, shift : array, shapes (R,) and (2, R)
        Memory for obstacles that may hide boids from one boid, at most R.
    times : array of int, shape (4,)
        Steps, counted from 0, with the indices SINCE, NOW, SAMPLED and SENT: first step
        of the sensing model, NOT_BEGUN before; current step; step of the last sample;
        step in which the messages of the last sample were sent.
    silent_from, blind_from : array of int, shape (N,)
        First step in which a boid is in no message, and first step in which a boid
        perceives no boid.
    key : ChanceKey
        Key of errors and lost packets.
    law : ErrorLaw
    knows_itself, shares_errors : bool
        Whether a boid knows itself exactly, and whether the errors of a boid about
        itself are equal to the errors in messages.
    delay, period : int
        Age of messages, and time between two samples, in steps.
    radio_range, packet_loss, packet_loss_range : float
        Parameters of Sensing.
    obstacles_hide, boids_hide : bool
        Whether obstacles and bodies hide boids.
    body_radius : float
        Radius of a boid that hides others.
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
    """Return the steps (N,) of an event that happens to no boid, for `n` boids."""
    return np.full(n, NEVER)


def is_ideal(sensing: Sensing, dt: float) -> bool:
    """Return whether perception is exact and without delay, in steps of `dt`."""
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
    """Return a time in steps of `dt`; the time is a multiple of `dt`."""
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
    """Return the sensing model of a flock at the start of a trial, None if ideal.

    With None, boids know the exact state of all boids in sight, and kernels are
    compiled without a sensing model.

    Parameters
    ----------
    sensing : Sensing
        Noise, delay, range and occlusion.
    n : int
        Number of boids.
    dt : float
        Time of a step.
    world : World
    key : ChanceKey
        Key of errors and lost packets.
    silent_from, blind_from : array of int, shape (n,)
        First step in which a boid is silent or blind, NEVER for a boid that works.
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
    """Resume a sensing model from an `earlier` model of as many boids, if possible.

    Returns whether the model resumes, which needs an equal law of errors and an equal
    delay. Else the model begins again in the next step.
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
    """Return the law of the errors of measurement in steps of `dt`.

    Independent errors are AR(1) with the correlation exp(-dt / noise_time). Coupled
    errors are the exact solution of dq = u dt, du = -(u / noise_time) dt - k q dt +
    noise, with k = (velocity_noise / position_noise)^2. The equations describe a damped
    spring driven by white noise: Uhlenbeck and Ornstein (1930), On the theory of the
    Brownian motion, Physical Review 36, 823-841, section IV.

    The stationary covariance is S = diag(position_noise^2, velocity_noise^2). M is the
    exponential of the matrix of the equations times dt. The covariance of the added
    noise is S - M S M', so that S is constant for any dt.
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
    """Return the matrix exponential of (0, 1; -k, -1 / time) times `dt`, row by row."""
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
    """Return the variance of q, the covariance and the variance of u added in `dt`.

    White noise of u adds the covariance, which is an integral. The integrand is the
    outer product of the response to a kick of u, the second column of `_spring`.

    S - M S M' is mathematically equal, but loses nearly all digits if dt is short:
    there the variance of q is of the order of dt^3. So the integral is computed over a
    part of dt in which the spring has hardly moved. Then the interval is doubled as
    often as needed, by sums alone: the integral over 2 t is Q(t) + M(t) Q(t) M(t)'. The
    sums are Python sums, because the order of NumPy's sums depends on the processor.
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
