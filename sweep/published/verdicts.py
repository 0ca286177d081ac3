"""Verdicts on published claims by estimates. Verdicts are computed, and can fail.

An expectation allows a region. A published number allows the margin and the rounding to
either side. A bound allows all values above or below the bound, two bounds the range in
between. With m claims in the family of a publication, each claim has the simultaneous
interval of confidence 1 - 0.05/m (Bonferroni). A claim is confirmed if the interval is
inside the region, refuted if the interval is outside, and undecided otherwise. So too
few trials neither confirm nor refute a claim. The probability of even one wrong verdict
in a publication is at most 0.05.

The order of a transition has no region. The order follows from the sizes of a study
with the simultaneous confidence, and is undecided if the sizes do not decide.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from sweep.analysis import CONFIDENCE, Estimate, Order, simultaneous_confidence
from sweep.methods.scaling import Scaling

Status = Literal[
    "confirmed", "refuted", "undecided", "partial", "not run", "not testable"
]

LEVEL = 1.0 - CONFIDENCE
ROUNDING_ERROR = 1e-12
"""Relative difference of equal numbers: only the order of a sum differs."""
MOST_TIMES = 1e6
"""Largest factor for the number of trials: a million times as many are impractical."""
STEPS = 14
"""Bisection steps from a million on a logarithmic scale, to less than a hundredth."""


class Value(NamedTuple):
    """A published number.

    Attributes
    ----------
    value : float
    rounding : float
        Half a unit of the last digit.
    trials : int, optional
        Number of published trials.
    margin : float
        Difference up to which two numbers count as equal.
    because : str
        Reason of the margin.
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
    """The quantity is between `low` and `high`: a test of equivalence."""

    low: float
    high: float


class OfOrder(NamedTuple):
    """The transition is of this order, `first order` or `continuous`."""

    order: Order


Numeric = Value | Above | Below | Within
"""Expectation for a number."""
Expectation = Numeric | OfOrder


class Region(NamedTuple):
    """Values that an expectation allows.

    A single bound is outside the region; two bounds are inside.
    """

    least: float
    most: float

    @property
    def half_width(self) -> float:
        """Half of the width: the margin of a number. Infinite with a single bound."""
        return (self.most - self.least) / 2.0

    def verdict(self, low: float, high: float) -> Status:
        """Return the verdict from a confidence interval.

        Parameters
        ----------
        low : float
        high : float
            Bounds of the interval, in the unit of the region.
        """
        if self.half_width < math.inf:
            inside = self.least <= low and high <= self.most
            outside = high < self.least or low > self.most
        else:
            inside = self.least < low and high < self.most
            outside = high <= self.least or low >= self.most
        return "confirmed" if inside else "refuted" if outside else "undecided"


@dataclass(frozen=True)
class Verdict:
    """The status of a claim and the reason.

    Attributes
    ----------
    status : Status
    reason : str
    interval : tuple of float, optional
        Ordinary 95 % confidence interval; None without a test.
    simultaneous : tuple of float, optional
        Confidence interval for the verdict; None without a test.
    weak : bool
        True if the stored trials could not confirm the claim.
    needed : int, optional
        Number of trials that would decide an undecided claim, for an unchanged mean and
        spread; None if a million times as many would not.
    enough : int, optional
        Number of trials that could confirm a weak claim, for an unchanged spread; None
        if a million times as many would not be enough.
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
        """Half-width of the simultaneous interval; None without a test."""
        if self.simultaneous is None:
            return None
        return _half(*self.simultaneous)


def untestable(reason: str) -> Verdict:
    """Return the verdict on a claim that cannot be tested."""
    return Verdict("not testable", reason)


def not_run(reason: str) -> Verdict:
    """Return the verdict on a claim without trials."""
    return Verdict("not run", reason)


def partial(verdict: Verdict, missing: str) -> Verdict:
    """Return a verdict as partial: some trials are `missing`, numbers may change."""
    return replace(
        verdict, status="partial", reason=f"{missing}; so far: {verdict.reason}"
    )


def region(expectation: Numeric) -> Region:
    """Return the region that an expectation allows."""
    if isinstance(expectation, Above):
        return Region(expectation.bound, math.inf)
    if isinstance(expectation, Below):
        return Region(-math.inf, expectation.bound)
    if isinstance(expectation, Within):
        return Region(expectation.low, expectation.high)
    value = expectation.value
    slack = expectation.margin + expectation.rounding + ROUNDING_ERROR * abs(value)
    return Region(value - slack, value + slack)


def judge_order(scaling: Scaling, expectation: OfOrder, family: int) -> Verdict:
    """Return the verdict on a claim of the order of a transition.

    Parameters
    ----------
    scaling : Scaling
        Scaling with the sizes of a study.
    expectation : OfOrder
        Expected order.
    family : int
        Number of claims whose verdicts are simultaneous.
    """
    confidence = simultaneous_confidence(max(family, 1))
    order, why = replace(scaling, confidence=confidence).order
    status: Status = "confirmed" if order == expectation.order else "refuted"
    return Verdict(
        "undecided" if order == "not decided" else status,
        f"the order with confidence {confidence:.5g} is {order}: {why}",
    )


def judge(
    estimate: Estimate, expectation: Numeric, family: int, trials: int
) -> Verdict:
    """Return the verdict on one claim.

    Parameters
    ----------
    estimate : Estimate
        Our estimate.
    expectation : Numeric
        Expectation for the estimate.
    family : int
        Number of claims whose verdicts are simultaneous.
    trials : int
        Number of trials of the estimate.
    """
    if not estimate.testable:
        return untestable(
            "our measure has too few values for an interval, or all values are equal,"
            " except for one at most"
        )
    if not math.isfinite(estimate.value):
        return untestable("one of the values is infinite")
    grows = _Growing(estimate, expectation, family)
    allowed = grows.allowed
    low, high = grows.interval(1.0)
    status = allowed.verdict(low, high)
    reason = _compared(estimate, expectation, status, (low, high))
    needed = None
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
    """Difference that a claim could detect with more trials of unchanged spread.

    Attributes
    ----------
    trials : int
        Number of trials.
    noticeable : float
        Half-width of the simultaneous interval.
    margin : float
        Half-width of the expectation; infinite with a single bound.
    enough : int or None
        Number of trials that could detect the margin. With a single bound, the number
        that would decide for an unchanged mean. None if a million times as many would
        not be enough.
    """

    trials: int
    noticeable: float
    margin: float
    enough: int | None

    @property
    def weak(self) -> bool:
        """True if the trials could not confirm the claim."""
        return self.noticeable > self.margin


def foresee(
    estimate: Estimate,
    expectation: Numeric,
    family: int,
    trials: int,
    times: float,
) -> Foreseen:
    """Return the difference that a claim could detect with more trials.

    Parameters
    ----------
    estimate : Estimate
        A testable estimate.
    expectation : Numeric
        Expectation for the estimate.
    family : int
        Number of claims whose verdicts are simultaneous.
    trials : int
        Number of trials of the estimate.
    times : float
        Factor for the number of trials.
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
    """Simultaneous interval of a claim with more trials of equal mean and spread.

    `judge` explains the arguments.
    """

    def __init__(self, estimate: Estimate, expectation: Numeric, family: int) -> None:
        self.estimate = estimate
        self.published = expectation.trials if isinstance(expectation, Value) else None
        self.confidence = simultaneous_confidence(max(family, 1))
        self.allowed = region(expectation)

    def interval(self, times: float) -> tuple[float, float]:
        """Return the interval with `times` as many trials."""
        estimate = self.estimate if times == 1.0 else self.estimate.grown(times)
        return estimate.interval(self.confidence, self.published)

    def enough(self, trials: int) -> int | None:
        """Return the number of trials with an interval as narrow as the margin."""
        margin = self.allowed.half_width
        return self._least(trials, lambda *bounds: _half(*bounds) <= margin)

    def decisive(self, trials: int) -> int | None:
        """Return the number of trials with an interval that confirms or refutes."""
        return self._least(
            trials, lambda *bounds: self.allowed.verdict(*bounds) != "undecided"
        )

    def _least(self, trials: int, holds: Callable[[float, float], bool]) -> int | None:
        """Return the least number of trials for which `holds` is true of the interval.

        The number is rounded up to two digits. Return `trials` if `trials` are enough,
        and None if a million times as many are too few.
        """
        if holds(*self.interval(1.0)):
            return trials
        if not holds(*self.interval(MOST_TIMES)):
            return None
        low = 0.0
        high = math.log(MOST_TIMES)
        for _ in range(STEPS):
            middle = (low + high) / 2.0
            held = holds(*self.interval(math.exp(middle)))
            low, high = (low, middle) if held else (middle, high)
        return _two_digits(math.ceil(trials * math.exp(high)))


def _half(low: float, high: float) -> float:
    return (high - low) / 2.0


def _compared(
    estimate: Estimate,
    expectation: Numeric,
    status: Status,
    interval: tuple[float, float],
) -> str:
    """Return in words the result of the simultaneous interval."""
    if isinstance(expectation, Value):
        ours = estimate.value
        published = expectation.value
        interval = (interval[0] - published, interval[1] - published)
        text = (
            f"differs by {brief(ours - published, sign=True)}, and {_range(interval)}"
        )
        allowed = "the margin"
    else:
        text = _range(interval)
        allowed = "the expected range"
    lies = {
        "confirmed": f"is completely within {allowed}",
        "refuted": f"is completely outside {allowed}",
    }
    return f"{text} {lies.get(status, f'overlaps the limit of {allowed}')}"


def _range(interval: tuple[float, float]) -> str:
    return f"the simultaneous interval {brief(interval[0])} to {brief(interval[1])}"


def _two_digits(count: int) -> int:
    unit = int(10 ** max(0, len(str(count)) - 2))
    return -(-count // unit) * unit


def _foresight(needed: int | None, trials: int, published: int | None) -> str:
    """Return in words the effect of more trials."""
    if needed is not None:
        return (
            f"about {needed:,} trials instead of {trials:,} would decide the claim, for"
            " an unchanged mean and spread"
        )
    remains = (
        f", because the chance error of the {published:,} published trials remains"
        if published
        else ""
    )
    return (
        "a million times as many trials would not decide the claim, for an unchanged"
        f" mean and spread{remains}"
    )


def brief(number: float, *, sign: bool = False) -> str:
    """Return a number to four significant digits."""
    return f"{number:+.4g}" if sign else f"{number:.4g}"
