"""Runs operations step by step in every order: which of them takes the next step is
decided, never left to luck.

An operation runs in a thread of its own, and stops before each step that others can
notice, or whose outcome they can change. The explorer lets one thread at a time go on,
and tries each of them at each step, from the beginning of a new world every time. Two
orders that have led to the same state of the world, with each operation having seen the
same so far, go on alike: one of them is followed. Of two steps that touch different
things, or only look, one order is followed as well: the other leads to the same state
(sleep sets: Godefroid, Partial-Order Methods for the Verification of Concurrent
Systems, 1996, chapters 5 and 6). All states are met nevertheless.

What was seen is remembered by hashes of 64 bits, as a million states would take
gigabytes. That two of a million are taken for one happens in one of 10 million runs.
"""

import threading
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import NamedTuple

from tests.patience import PATIENCE

State = Hashable
"""What a world holds, as far as operations can notice."""


class Abandoned(BaseException):
    """Nobody wants to know how this operation goes on."""


class Step(NamedTuple):
    """What a step will touch, as paths; whether it changes any; and what it will see,
    known at the time.
    """

    paths: Sequence[str]
    writes: bool
    look: Callable[[], Hashable]

    def commutes_with(self, other: "Step") -> bool:
        """Whether to take this step and another one in either order is the same."""
        if not (self.writes or other.writes):
            return True
        return not any(
            _is_within(ours, theirs) or _is_within(theirs, ours)
            for ours in self.paths
            for theirs in other.paths
        )


def _is_within(path: str, folder: str) -> bool:
    return path == folder or path.startswith(f"{folder.rstrip('/')}/")


BEGINNING = Step((), False, lambda: "begins")


class World(NamedTuple):
    """Operations on something new, `state` of which says what it holds; `check` is
    called when all are over.
    """

    operations: Sequence[Callable[[], None]]
    state: Callable[[], State]
    check: Callable[[], None]


class Explored(NamedTuple):
    """How many orders were followed to their end, and how many different states were
    met on the way.
    """

    orders: int
    states: int


class _Thread:
    """An operation, which goes on when it is granted a step, until it asks for the
    next.
    """

    def __init__(self, operation: Callable[[], None]) -> None:
        self.seen = 0
        self.next = BEGINNING
        self.over = self.abandoned = False
        self.error: BaseException | None = None
        self._operation = operation
        self._granted, self._asked = threading.Semaphore(0), threading.Semaphore(0)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        self._wait()

    def grant(self) -> None:
        """Let it go on, and wait until it asks again, or is over."""
        self._granted.release()
        self._wait()

    def _wait(self) -> None:
        if not self._asked.acquire(timeout=PATIENCE):
            raise AssertionError("an operation waits for another one, or never ends")

    def ask(self, step: Step) -> None:
        """Wait for a grant of a step, and see then what it will see."""
        self.next = step
        self._asked.release()
        self._granted.acquire()
        if self.abandoned:
            raise Abandoned
        self.seen = hash((self.seen, step.look()))

    def abandon(self) -> None:
        """End it where it is."""
        self.abandoned = True
        while not self.over:
            self.grant()
        self._thread.join()

    def _run(self) -> None:
        _current.thread = self
        try:
            self.ask(BEGINNING)
            self._operation()
        except Abandoned:
            pass
        except BaseException as error:
            self.error = error
        self.over = True
        self._asked.release()


_current = threading.local()


def step(of: Step) -> None:
    """Called before a step: in the thread of an operation it waits for its turn,
    elsewhere it does nothing.
    """
    thread = getattr(_current, "thread", None)
    if thread is not None and not (thread.abandoned or thread.over):
        _current.thread = None  # what `look` does is no step
        try:
            thread.ask(of)
        finally:
            _current.thread = thread


def explore(make: Callable[[], World], most_switches: int | None = None) -> Explored:
    """Run the operations of a new world in every order, or in all with so many switches
    between unfinished ones.

    Raises what an operation or a check raises, with the order: the numbers of the
    operations, a sign a step.
    """
    met = dict[int, frozenset[int]]()
    """The states, and the operations whose next step needs not be taken there, as the
    state to which it leads is met in another order: they sleep.
    """
    todo = [("", frozenset[int]())]
    """Beginnings of orders, and who sleeps after their last step."""
    orders = 0
    while todo:
        prefix, asleep = todo.pop()
        world = make()
        threads = [_Thread(operation) for operation in world.operations]
        taken, switches, known = "", 0, False
        try:
            while alive := [
                number for number, thread in enumerate(threads) if not thread.over
            ]:
                choices = _in_order(alive, taken)
                as_before = choices[0]
                if len(taken) < len(prefix):
                    choice = int(prefix[len(taken)])
                else:
                    left = None if most_switches is None else most_switches - switches
                    seen = tuple(thread.seen for thread in threads)
                    last = None if left is None else taken[-1:]
                    key = hash((world.state(), seen, left, last))
                    awake = met[key] - asleep if key in met else set(alive) - asleep
                    met[key] = asleep & met.get(key, asleep)
                    choices = [number for number in choices if number in awake]
                    known = not choices
                    if known:
                        break
                    choice = choices[0]
                    if left is not None and not (left > 0 or _is_free(alive, taken)):
                        choices = choices[:1]
                    after = dict[int, frozenset[int]]()
                    for number in choices:
                        others = asleep | after.keys() if left is None else ()
                        after[number] = _still_asleep(threads, number, others)
                    asleep = after.pop(choice)
                    todo += [(f"{taken}{other}", after[other]) for other in after]
                switches += choice != as_before and not _is_free(alive, taken)
                taken += str(choice)
                threads[choice].grant()
                if error := threads[choice].error:
                    raise error
            if not known:
                world.check()
                orders += 1
        except BaseException as error:
            error.add_note(f"in the order {taken}")
            raise
        finally:
            for thread in threads:
                thread.abandon()
    return Explored(orders, len(met))


def _still_asleep(
    threads: Sequence[_Thread], number: int, asleep: Iterable[int]
) -> frozenset[int]:
    """Those whose next step can be taken before the next one of a thread as well."""
    step = threads[number].next
    return frozenset(
        other for other in asleep if step.commutes_with(threads[other].next)
    )


def _is_free(alive: Sequence[int], taken: str) -> bool:
    """Whether to go on with any operation is no switch: at the beginning, and where the
    last one is over.
    """
    return not taken or int(taken[-1]) not in alive


def _in_order(alive: Sequence[int], taken: str) -> list[int]:
    """Those that can go on, the one that has taken the last step first."""
    last = taken[-1:]
    return sorted(alive, key=lambda number: (str(number) != last, number))
