"""Verdicts: whether an estimate agrees with what was published. They are computed,
two-sided, and can fail.

With m claims on a page, each is tested at the level 0.05/m (Bonferroni). A published
number is reproduced unless it lies outside the simultaneous interval. A published bound
is reproduced only if the whole simultaneous interval lies on its right side, so too few
trials never show it. With a true number the chance of "not reproduced" is at most 0.05
for the whole page, and so is the chance of "reproduced" with a false bound.
"""

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

from sweep.analysis import CONFIDENCE, Estimate, simultaneous_confidence

Status = Literal["reproduced", "not reproduced", "not testable as published"]

LEVEL = 1.0 - CONFIDENCE
ROUNDING_ERROR = 1e-12
"""Relative. Two numbers this close count as equal: only the order of a sum differs."""


class Value(NamedTuple):
    """A published number, with its rounding (half a unit of its last digit), the number
    of its trials, and the margin within which ours counts as the same, with its reason.
    """

    value: float
    rounding: float = 0.0
    trials: int | None = None
    margin: float | None = None
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


Expectation = Value | Above | Below | Within


@dataclass(frozen=True)
class Verdict:
    """The status and its reason. `interval` is the ordinary 95 % one.

    `noticeable` is the smallest difference that the test could notice: half the
    simultaneous interval, plus rounding and margin. Both are None if nothing was
    tested.
    """

    status: Status
    reason: str
    interval: tuple[float, float] | None = None
    noticeable: float | None = None


def untestable(reason: str) -> Verdict:
    """The verdict on a claim that cannot be tested."""
    return Verdict("not testable as published", reason)


def judge(estimate: Estimate, expectation: Expectation, claims: int) -> Verdict:
    """The verdict on one of the `claims` claims of a page."""
    if not estimate.testable:
        return untestable("too few values for an interval, or one that does not vary")
    if not math.isfinite(estimate.value):
        return untestable("one of the values is infinite")
    published = expectation.trials if isinstance(expectation, Value) else None
    low, high = estimate.interval(simultaneous_confidence(claims), published)
    half = (high - low) / 2.0
    if isinstance(expectation, Value):
        half += expectation.rounding + (expectation.margin or 0.0)
        status, reason = _equal(estimate.value, low, high, expectation)
    else:
        status, reason = _beyond(low, high, *_allowed(expectation))
    return Verdict(status, reason, estimate.interval(), half)


def _equal(
    ours: float, low: float, high: float, expectation: Value
) -> tuple[Status, str]:
    """Reproduced if the interval, widened by rounding and margin, contains the
    value.
    """
    published, rounding = expectation.value, expectation.rounding
    margin = expectation.margin or 0.0
    slack = rounding + margin + ROUNDING_ERROR * max(abs(ours), abs(published))
    sources = ["chance"] + ["rounding"] * (rounding > 0) + ["the margin"] * (margin > 0)
    explained = (
        "chance alone"
        if len(sources) == 1
        else ", ".join(sources[:-1]) + " and " + sources[-1]
    )
    found = f"differs by {brief(ours - published, sign=True)}"
    if low - slack <= published <= high + slack:
        return "reproduced", f"{found}, which {explained} may explain"
    return "not reproduced", f"{found}, more than {explained} may explain"


def _allowed(expectation: Above | Below | Within) -> tuple[float, float]:
    if isinstance(expectation, Above):
        return expectation.bound, math.inf
    if isinstance(expectation, Below):
        return -math.inf, expectation.bound
    return expectation.low, expectation.high


def _beyond(low: float, high: float, least: float, most: float) -> tuple[Status, str]:
    """Reproduced if the whole interval lies between `least` and `most`. A one-sided
    bound itself does not count as inside.
    """
    interval = f"the simultaneous interval {brief(low)} to {brief(high)}"
    equivalence = math.isfinite(least) and math.isfinite(most)
    if (
        (least <= low and high <= most)
        if equivalence
        else (least < low and high < most)
    ):
        return "reproduced", f"{interval} lies wholly there"
    if high < least or low > most:
        return (
            "not reproduced",
            f"the opposite was shown: {interval} lies wholly on the other side",
        )
    return (
        "not reproduced",
        f"nothing could be shown: {interval} reaches across the bound",
    )


def brief(number: float, *, sign: bool = False) -> str:
    """A number to four significant digits."""
    return f"{number:+.4g}" if sign else f"{number:.4g}"
