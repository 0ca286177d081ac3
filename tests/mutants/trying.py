"""Mutants are tried: one after the other, and all that are left together.

First each mutant alone meets the tests that are nearest to it, and then those of its
package, for twenty minutes at most. Most are noticed there.

All that are left are then made in one copy, and the whole suite runs once. A test that
passes with all of them would pass with each alone. So only the tests that fail can
notice one, and these run for each mutant alone: the first that fails has noticed it.
That finds what a run of the whole suite for each mutant would find, in the time of one
run, but for mistakes that hide each other: a test may pass with two of them and fail
with either.

If the run of a group tells nothing, since too many tests fail or the time is over, the
group is halved. A mutant that is then alone is noticed by the tests that fail, and is
undecided if the time is over.

A test that fails without any mistake notices nothing. It is found when it is the first
to fail, and is left out from then on.
"""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from queue import SimpleQueue
from typing import NamedTuple

from tests.mutants.copies import ALONE, Copy
from tests.mutants.drawing import Mutant
from tests.mutants.nearest import is_there, nearest, of_package
from tests.mutants.results import KILLED, OPEN, SURVIVED, UNDECIDED, Result, Tell

NEAR_SECONDS = 1200.0
GROUP_SECONDS = 90 * 60.0
MOST_FAILED = 300
"""More tests that fail tell nothing of a single mutant."""


class Noticed(NamedTuple):
    """That a test has noticed a mutant: its name, or "" if pytest broke off."""

    test: str


def near(copy: Copy, mutant: Mutant, earlier: str) -> Result:
    """What the nearest tests say of a mutant: killed, or open.

    Parameters
    ----------
    earlier
        The test that noticed it in another run, or "". It is tried first.
    """
    ends = time.monotonic() + NEAR_SECONDS
    known = earlier.partition("[")[0]  # its values may be others by now
    first = [[known]] if known and is_there(copy.folder, known) else []
    package = of_package(copy.folder, mutant.path)
    for tests in (*first, nearest(copy.folder, mutant.path), package):
        if noticed := _noticed(copy, [mutant], tests, ends):
            return Result.of(mutant, KILLED, noticed.test)
    return Result.of(mutant, OPEN)


def _noticed(
    copy: Copy, mutants: Sequence[Mutant], tests: Sequence[str], ends: float
) -> Noticed | None:
    """The first of some tests that notices mutants, if one does in time."""
    while left := [one for one in tests if one not in copy.unsound]:
        with copy.mistaken(mutants):
            outcome = copy.run([*ALONE, *left], ends - time.monotonic())
        if not outcome.is_kill:
            return None
        if copy.sound(outcome.failed or left, GROUP_SECONDS):
            return Noticed(outcome.failed[0] if outcome.failed else "")
    return None


def spread(
    copies: Sequence[Copy],
    mutants: Sequence[Mutant],
    act: Callable[[Copy, Mutant], None],
) -> None:
    """Try each of some mutants in a copy that is idle."""
    idle: SimpleQueue[Copy] = SimpleQueue()
    for copy in copies:
        idle.put(copy)

    def one(mutant: Mutant) -> None:
        copy = idle.get()
        try:
            act(copy, mutant)
        finally:
            idle.put(copy)

    with ThreadPoolExecutor(len(copies)) as pool:
        list(pool.map(one, mutants))


def together(copies: Sequence[Copy], mutants: Sequence[Mutant], tell: Tell) -> None:
    """What the whole suite says of mutants: killed, survived or undecided."""
    for group in groups(mutants):
        _together(copies, group, tell)


def groups(mutants: Sequence[Mutant]) -> list[list[Mutant]]:
    """Mutants, divided so that no two of a group overlap."""
    found: list[list[Mutant]] = []
    for one in mutants:
        for group in found:
            if not any(_overlap(one, other) for other in group):
                group.append(one)
                break
        else:
            found.append([one])
    return found


def _overlap(one: Mutant, other: Mutant) -> bool:
    return one.path == other.path and one.start < other.end and other.start < one.end


def _together(copies: Sequence[Copy], group: Sequence[Mutant], tell: Tell) -> None:
    copy = copies[0]
    with copy.mistaken(group):
        outcome = copy.run(["-n", "2"], GROUP_SECONDS)
    is_over = outcome.code is None
    broke_off = outcome.is_kill and not outcome.failed
    if is_over or broke_off or len(outcome.failed) > MOST_FAILED:
        middle = len(group) // 2
        if middle:
            _together(copies, group[:middle], tell)
            _together(copies, group[middle:], tell)
            return
        if is_over or broke_off:
            tell(Result.of(group[0], UNDECIDED if is_over else KILLED))
            return
    tests = copy.sound(outcome.failed[:MOST_FAILED], GROUP_SECONDS)

    def alone(idle: Copy, mutant: Mutant) -> None:
        ends = time.monotonic() + GROUP_SECONDS
        noticed = _noticed(idle, [mutant], tests, ends) if tests else None
        test = noticed.test if noticed else ""
        tell(Result.of(mutant, KILLED if noticed else SURVIVED, test))

    spread(copies, group, alone)
