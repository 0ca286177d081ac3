"""Verdicts: what an estimate shows about a published claim. They are computed, and can
fail.

An expectation allows a region: a published number with its margin and its rounding to
both sides, all above or below a bound, or what lies within two. With m claims in the
family of a document each has the simultaneous interval of confidence 1 - 0.05/m
(Bonferroni). A claim is confirmed where this interval lies wholly in the region,
refuted where it lies wholly outside, and undecided otherwise. So too few trials neither
confirm nor refute anything, and the chance of even one wrong verdict in a document is
at most 0.05.

The order of a transition has no region: it is what the sizes of a study tell with that
confidence, and undecided where they do not decide.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from sweep.analysis import CONFIDENCE, Estimate, simultaneous_confidence
from sweep.analysis.coexistence import Order
from sweep.methods.scaling import Scaling

Status = Literal[
    "confirmed", "refuted", "undecided", "partial", "not run", "not testable"
]

LEVEL = 1.0 - CONFIDENCE
ROUNDING_ERROR = 1e-12
"""Relative. Two numbers this close count as equal: only the order of a sum differs."""
MOST_TIMES = 1e6
"""Nobody will run a million times as many trials."""
STEPS = 14
"""Of halving a million on a logarithmic scale: to less than a hundredth."""


class Value(NamedTuple):
    """A published number, with its rounding (half a unit of its last digit), the number
    of its trials, and the margin within which ours is the same, with its reason.
    """

    value: float
    rounding: float = 0.0
    trials: int | None = None
    margin: float = 0.0
    because: str = ""


class Above(NamedTuple):
    """The quantity is larger than `bound`."""

    bound: float


class Below(NamedTuple):
    """The quantity is smaller than `bound`."""

    bound: float


class Within(NamedTuple):
    """The quantity lies between `low` and `high`: a test of equivalence."""

    low: float
    high: float


class OfOrder(NamedTuple):
    """The transition is of this order, `first order` or `continuous`."""

    order: Order


Numeric = Value | Above | Below | Within
"""What is expected of a number."""
Expectation = Numeric | OfOrder


class Region(NamedTuple):
    """What an expectation allows. A single bound itself is outside, two are inside."""

    least: float
    most: float

    @property
    def half_width(self) -> float:
        """Half the width: the margin of a number. Infinite with a single bound."""
        return (self.most - self.least) / 2.0

    def verdict(self, low: float, high: float) -> Status:
        """What an interval shows."""
        if self.half_width < math.inf:
            inside = self.least <= low and high <= self.most
            outside = high < self.least or low > self.most
        else:
            inside = self.least < low and high < self.most
            outside = high <= self.least or low >= self.most
        return "confirmed" if inside else "refuted" if outside else "undecided"


@dataclass(frozen=True)
class Verdict:
    """The status and its reason.

    interval      the ordinary 95 % interval
    simultaneous  the one that decided
    weak          whether it could not be confirmed with these trials
    needed        the number of trials that would decide what is undecided, if our mean
                  and spread stayed; None where a million times as many would not
    enough        the number of trials with which what is weak could be confirmed, if
                  our spread stayed; None where a million times as many would not do

    Intervals are None if nothing was tested.
    """

    status: Status
    reason: str
    interval: tuple[float, float] | None = None
    simultaneous: tuple[float, float] | None = None
    weak: bool = False
    needed: int | None = None
    enough: int | None = None

    @property
    def noticeable(self) -> float | None:
        """Half the width of the simultaneous interval; None if nothing was tested."""
        if self.simultaneous is None:
            return None
        return _half(*self.simultaneous)


def untestable(reason: str) -> Verdict:
    """The verdict on a claim that cannot be tested."""
    return Verdict("not testable", reason)


def not_run(reason: str) -> Verdict:
    """The verdict on a claim without trials."""
    return Verdict("not run", reason)


def partial(verdict: Verdict, missing: str) -> Verdict:
    """No verdict, from trials of which some are `missing`: its numbers may change."""
    return replace(
        verdict, status="partial", reason=f"{missing}; so far: {verdict.reason}"
    )


def region(expectation: Numeric) -> Region:
    """What an expectation allows."""
    if isinstance(expectation, Above):
        return Region(expectation.bound, math.inf)
    if isinstance(expectation, Below):
        return Region(-math.inf, expectation.bound)
    if isinstance(expectation, Within):
        return Region(expectation.low, expectation.high)
    value = expectation.value
    slack = expectation.margin + expectation.rounding + ROUNDING_ERROR * abs(value)
    return Region(value - slack, value + slack)


def judge_order(found: Scaling, expectation: OfOrder, family: int) -> Verdict:
    """The verdict on a claim of the order of a transition, by what is `found` of the
    sizes of a study. `family` as of `judge`.
    """
    confidence = simultaneous_confidence(max(family, 1))
    order, why = replace(found, confidence=confidence).order
    status: Status = "confirmed" if order == expectation.order else "refuted"
    return Verdict(
        "undecided" if order == "not decided" else status,
        f"with the confidence {confidence:.5g} it is {order}: {why}",
    )


def judge(
    estimate: Estimate, expectation: Numeric, family: int, trials: int
) -> Verdict:
    """The verdict on one claim.

    estimate     ours
    expectation  what is expected of it
    family       the number of claims whose verdicts hold together
    trials       the number of trials behind the estimate
    """
    if not estimate.testable:
        return untestable(
            "our measure has too few values for an interval, or values that are equal,"
            " but for one at most"
        )
    if not math.isfinite(estimate.value):
        return untestable("one of the values is infinite")
    grows = _Growing(estimate, expectation, family)
    allowed, (low, high) = grows.allowed, grows.interval(1.0)
    status = allowed.verdict(low, high)
    reason, needed = _found(estimate, expectation, status, (low, high)), None
    if status == "undecided":
        needed = grows.decisive(trials)
        reason = f"{reason}; {_foresight(needed, trials, grows.published)}"
    weak = _half(low, high) > allowed.half_width
    return Verdict(
        status,
        reason,
        estimate.interval(),
        (low, high),
        weak=weak,
        needed=needed,
        enough=grows.enough(trials) if weak else None,
    )


class Foreseen(NamedTuple):
    """What a claim could notice with more trials, if their spread stayed.

    trials      so many
    noticeable  half the width of the simultaneous interval
    margin      half the width of what is expected; infinite with a single bound
    enough      the number of trials with which the margin could be noticed, or that
                would decide for a single bound if our mean stayed too; None where a
                million times as many would not do
    """

    trials: int
    noticeable: float
    margin: float
    enough: int | None

    @property
    def weak(self) -> bool:
        """Whether the claim could not be confirmed."""
        return self.noticeable > self.margin


def foresee(
    estimate: Estimate,
    expectation: Numeric,
    family: int,
    trials: int,
    times: float,
) -> Foreseen:
    """What a claim could notice with `times` as many trials as an estimate rests on,
    which must be testable. The others as of `judge`.
    """
    grows = _Growing(estimate, expectation, family)
    margin = grows.allowed.half_width
    return Foreseen(
        round(trials * times),
        _half(*grows.interval(times)),
        margin,
        grows.enough(trials) if margin < math.inf else grows.decisive(trials),
    )


class _Growing:
    """The simultaneous interval of a claim with more trials, if mean and spread stay.
    The arguments are those of `judge`.
    """

    def __init__(self, estimate: Estimate, expectation: Numeric, family: int) -> None:
        self.estimate = estimate
        self.published = expectation.trials if isinstance(expectation, Value) else None
        self.confidence = simultaneous_confidence(max(family, 1))
        self.allowed = region(expectation)

    def interval(self, times: float) -> tuple[float, float]:
        """The interval with `times` as many trials."""
        estimate = self.estimate if times == 1.0 else self.estimate.grown(times)
        return estimate.interval(self.confidence, self.published)

    def enough(self, trials: int) -> int | None:
        """The number of trials whose interval is as narrow as the margin."""
        margin = self.allowed.half_width
        return self._least(trials, lambda *bounds: _half(*bounds) <= margin)

    def decisive(self, trials: int) -> int | None:
        """The number of trials whose interval confirms or refutes."""
        return self._least(
            trials, lambda *bounds: self.allowed.verdict(*bounds) != "undecided"
        )

    def _least(self, trials: int, holds: Callable[[float, float], bool]) -> int | None:
        """The number of trials from which on something `holds` of the interval, rounded
        up to two digits: `trials` where these are enough, None where a million times as
        many are too few.
        """
        if holds(*self.interval(1.0)):
            return trials
        if not holds(*self.interval(MOST_TIMES)):
            return None
        low, high = 0.0, math.log(MOST_TIMES)
        for _ in range(STEPS):
            middle = (low + high) / 2.0
            found = holds(*self.interval(math.exp(middle)))
            low, high = (low, middle) if found else (middle, high)
        return _two_digits(math.ceil(trials * math.exp(high)))


def _half(low: float, high: float) -> float:
    return (high - low) / 2.0


def _found(
    estimate: Estimate,
    expectation: Numeric,
    status: Status,
    interval: tuple[float, float],
) -> str:
    """What the simultaneous interval shows, in words."""
    if isinstance(expectation, Value):
        ours, published = estimate.value, expectation.value
        interval = interval[0] - published, interval[1] - published
        found = (
            f"differs by {brief(ours - published, sign=True)}, and {_range(interval)}"
        )
        allowed = "the margin"
    else:
        found, allowed = _range(interval), "what is expected"
    lies = {
        "confirmed": f"lies wholly within {allowed}",
        "refuted": f"lies wholly outside {allowed}",
    }
    return f"{found} {lies.get(status, f'reaches across the edge of {allowed}')}"


def _range(interval: tuple[float, float]) -> str:
    return f"the simultaneous interval {brief(interval[0])} to {brief(interval[1])}"


def _two_digits(count: int) -> int:
    unit = int(10 ** max(0, len(str(count)) - 2))
    return -(-count // unit) * unit


def _foresight(needed: int | None, trials: int, published: int | None) -> str:
    """What more trials would decide, in words."""
    if needed is not None:
        return (
            f"about {needed:,} trials instead of {trials:,} would decide it if our mean"
            " and spread stayed"
        )
    remains = (
        f", as the chance error of the {published:,} published ones remains"
        if published
        else ""
    )
    return (
        "a million times as many trials would not decide it if our mean and spread"
        f" stayed{remains}"
    )


def brief(number: float, *, sign: bool = False) -> str:
    """A number to four significant digits."""
    return f"{number:+.4g}" if sign else f"{number:.4g}"
