"""Threads: what a text of `advance` becomes, and which texts are refused."""

import inspect
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.util import module_from_spec, spec_from_file_location
from itertools import count
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from kernels.jit import jit_as
from kernels.lanes.calls import plain_of
from kernels.model import Model, flaw
from kernels.models import MODELS
from kernels.settings import UPDATE, About
from kernels.threads.barrier import give_up, wait
from kernels.threads.slices import NotForThreadsError, kernel_of
from kernels.threads.team import Team, build_teams

NAMES = count()
TEXT = '''"""A model's step."""

from kernels.neighbours import move_all
from kernels.recording import observe
from kernels.state import remember


def advance(flock, world, params, work, record, rng, steps):
    """Advance the flock."""
    seen, dt = work.before, params.dt
    for _ in range(steps):
        remember(flock, seen)
        for i in range(flock.x.size):
            flock.x[i] = seen.x[i] + dt * seen.vx[i]
        move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True
'''
Advance = Callable[..., bool]


@pytest.fixture
def read(tmp_path: Path) -> Iterator[Callable[..., Advance]]:
    """Gives `advance` of the text with some lines replaced, each of which it has."""
    made: list[str] = []

    def reading(*edits: tuple[str, str]) -> Advance:
        text = TEXT
        for old, new in edits:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        name = f"stepping_{next(NAMES)}"
        path = tmp_path / f"{name}.py"
        path.write_text(text)
        about = spec_from_file_location(name, path)
        assert about
        assert about.loader
        module = module_from_spec(about)
        sys.modules[name] = module
        made.append(name)
        about.loader.exec_module(module)
        advance: Advance = module.advance
        return advance

    yield reading
    for name in made:
        del sys.modules[name]


OBSERVED = "if not _observe(flock, world, record, _team):"
LOOP = "        for i in range(flock.x.size):\n"
BODY = "            flock.x[i] = seen.x[i] + dt * seen.vx[i]\n"
REFUSED = {
    "its boids draw random numbers one after the other": (
        (BODY, "            flock.x[i] = rng.normal()\n"),
    ),
    "its last loop is not over all steps": (("range(steps)", "range(2 * steps)"),),
    "it does not end with a loop over steps": (("    return True\n", ""),),
    "it does not end with `return True`": (("return True", "return dt > 0"),),
    "it does more than name values before": (
        ("    for _ in", "    work.heading_x[0] = 1.0\n    for _ in"),
    ),
    "it has a loop that is not over all boids": (
        ("range(flock.x.size)", "range(1, flock.x.size)"),
    ),
    "it leaves a loop over boids": (
        (BODY, f"{BODY}            if dt > 1:\n                break\n"),
    ),
    "between loops over boids it does more": ((LOOP, f"        dt = 2 * dt\n{LOOP}"),),
    "dt changes from boid to boid": ((BODY, f"{BODY}            dt += 1\n"),),
    "it has a test that boids could change": (
        ("        move_all(", "        if flock.x[0] > 1:\n            move_all("),
    ),
    "it does not call publish once a step": (("        remember(flock, seen)\n", ""),),
    "it does not call observe once a step": (
        ("if not observe(flock, world, record)", "if dt > 1"),
    ),
    "it has names that texts for threads have": (("seen, dt =", "seen, _team = "),),
}


@pytest.mark.parametrize("why", REFUSED)
def test_a_text_is_refused_that_says_not_what_is_done_for_each_boid(
    why: str, read: Callable[..., Advance]
) -> None:
    with pytest.raises(NotForThreadsError) as refused:
        kernel_of(read(*REFUSED[why]))
    assert why in str(refused.value)


def test_a_refusal_names_the_line(read: Callable[..., Advance]) -> None:
    with pytest.raises(NotForThreadsError, match=r"\(line 13\)"):
        kernel_of(read(("range(flock.x.size)", "range(1, flock.x.size)")))


def text_of(kernel: Any) -> str:
    """The text of a kernel as it was made."""
    return inspect.getsource(kernel.py_func)


def test_threads_wait_after_each_part_but_between_grid_and_observation(
    read: Callable[..., Advance],
) -> None:
    """They wait for each other within `_observe`, too."""
    text = text_of(kernel_of(read()))
    parts = [line.strip() for line in text.splitlines()]
    waits = [
        k for k, line in enumerate(parts) if line in ("if not _wait(_team):", OBSERVED)
    ]
    kinds = ("_remember(", "for i in", "move_all(", OBSERVED)
    places = [next(k for k, line in enumerate(parts) if kind in line) for kind in kinds]
    between = [
        sum(first < k < last for k in waits)
        for first, last in zip(places, [*places[1:], len(parts)], strict=True)
    ]
    assert between == [1, 1, 0, 0]
    assert OBSERVED in parts
    assert waits[0] < places[0]


def test_between_a_grid_and_a_loop_threads_wait(read: Callable[..., Advance]) -> None:
    """As in patel2023, where boids look after all have moved."""
    both = ("        if not observe", f"{LOOP}{BODY}        if not observe")
    text = text_of(kernel_of(read(both)))
    assert (
        text.count("if not _wait(_team)")
        == 1 + text_of(kernel_of(read())).count("if not _wait(_team)") + 1
    )


@pytest.mark.parametrize("model", MODELS)
def test_built_in_models_that_say_so_can_be_divided(model: str) -> None:
    about = MODELS[model]
    if about.at_once is None:
        with pytest.raises(NotForThreadsError):
            kernel_of(about.advance)
    else:
        assert callable(kernel_of(about.advance))


class Params(NamedTuple):
    """Of a model that is looked at, and never flies."""

    gain: Annotated[float, About("a gain", low=0)]
    update: Annotated[int, UPDATE]


@pytest.mark.parametrize(
    ("at_once", "said"),
    [
        (None, ""),
        ({}, ""),
        ({"update": "synchronous", "gain": 0.0}, ""),
        (("update",), "at_once is no mapping from settings to values"),
        ({"updaet": 1}, 'at_once names "updaet", which is no setting of its Params'),
        (
            {"update": "sync"},
            'at_once has update "sync"; allowed: sequential, synchronous',
        ),
        ({"gain": "much"}, "at_once has for gain what is no number"),
    ],
)
def test_what_a_model_says_is_looked_at(at_once: Any, said: str) -> None:
    model: Model = MODELS["nanobot"]._replace(params=Params, at_once=at_once)
    assert flaw(model) == said


def arriving(team: Team, log: Any, times: int) -> bool:
    """Whether nobody was late whenever all should have arrived."""
    for k in range(times):
        log[team.rank] = k
        if not wait(team):
            return False
        for other in range(log.size):
            if log[other] != k:
                return False
        if not wait(team):
            return False
    return True


def at_once(teams: list[Team], log: NDArray[np.int64], times: int) -> list[Future[Any]]:
    """What each thread finds. They have begun."""
    compiled = jit_as(arriving, plain_of(wait))
    pool = ThreadPoolExecutor(len(teams))
    found = [pool.submit(compiled, team, log, times) for team in teams]
    pool.shutdown(wait=False)
    return found


def test_nobody_goes_on_before_all_have_arrived() -> None:
    teams = build_teams(3, 10)
    found = at_once(teams, np.zeros(3, np.int64), 100)
    assert [one.result() for one in found] == [True] * 3


@pytest.mark.slow
def test_nobody_waits_for_a_thread_that_is_lost() -> None:
    teams = build_teams(3, 10)
    found = at_once(teams[:2], np.zeros(3, np.int64), 100)
    give_up(teams[2])
    assert [one.result() for one in found] == [False] * 2
