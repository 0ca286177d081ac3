"""A flight whose steps are taken by several threads."""

import threading
from collections.abc import Callable
from typing import Any

from numpy.random import Generator

from kernels.caching import is_kept
from kernels.coverage import N_SUMS
from kernels.events import N_EVENTS
from kernels.model import Model
from kernels.near import Near, build_near
from kernels.recording import Record
from kernels.state import Flock, World
from kernels.threads.barrier import give_up
from kernels.threads.slices import NotForThreadsError, kernel_of
from kernels.threads.team import Team, build_teams
from kernels.workspace import Workspace


def in_threads(model: Model, threads: int) -> Model:
    """The model as one flight has it whose boids are divided among so many threads.
    With one thread, and where nothing is compiled, it is the model itself.

    The flight has the same bits with any number of threads, if the model's settings
    fulfil its `at_once`. Raises NotForThreadsError where the text of `advance` does not
    say what is done for each boid.
    """
    if threads == 1 or not hasattr(model.advance, "py_func"):
        return model
    return model._replace(advance=Threads(model.advance, threads))


def is_kept_for_threads(model: Model) -> bool:
    """Whether the kernel of a model for several threads is compiled already; False
    where there is none.
    """
    try:
        return is_kept(kernel_of(model.advance))
    except NotForThreadsError:
        return False


class Threads:
    """Takes the steps of a model's `advance`, in threads of one flight.

    They begin and end with each call: a pool of threads would not survive a fork of the
    process, and a call takes much longer than to start them.
    """

    def __init__(self, advance: Callable[..., bool], threads: int) -> None:
        self.py_func = getattr(advance, "py_func", advance)
        self._kernel, self._threads = kernel_of(advance), threads
        self._near: list[Near] = []

    def __call__(
        self,
        flock: Flock,
        world: World,
        params: Any,
        work: Workspace,
        record: Record,
        rng: Generator,
        steps: int,
    ) -> bool:
        """As `advance` of a model. An error of any thread is raised."""
        n = flock.x.size
        while len(self._near) < self._threads - 1:
            self._near.append(build_near(n, work.near.topology))
        teams = build_teams(self._threads, n)
        ways = [(work, record)] + [
            (work._replace(near=near), _counting_apart(record, team))
            for near, team in zip(self._near, teams[1:], strict=True)
        ]
        going, errors = [False] * self._threads, list[BaseException]()

        def take(rank: int) -> None:
            try:
                own, kept = ways[rank]
                going[rank] = self._kernel(
                    flock, world, params, own, kept, rng, steps, teams[rank]
                )
            except BaseException as error:
                errors.append(error)
                give_up(teams[rank])

        _run(take, teams)
        if errors:
            raise errors[0]
        return going[0]


def _run(take: Callable[[int], None], teams: list[Team]) -> None:
    """Call `take` for each rank in a thread of its own, the first one in this thread.
    Returns when all have ended.
    """
    started: list[threading.Thread] = []
    try:
        for team in teams[1:]:
            thread = threading.Thread(target=take, args=(team.rank,), daemon=True)
            thread.start()
            started.append(thread)
        take(0)
    except BaseException:  # a thread that could not start, or an interruption
        give_up(teams[0])
        raise
    finally:
        for thread in started:
            thread.join()


def _counting_apart(record: Record, team: Team) -> Record:
    """A record whose events and sums of visits are those that this thread counts."""
    events, sums = team.events[team.rank, :N_EVENTS], team.sums[team.rank, :N_SUMS]
    return record._replace(
        watch=record.watch._replace(events=events),
        coverage=record.coverage._replace(sums=sums),
    )
