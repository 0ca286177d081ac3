"""Promises: a good model keeps all, and a bad one is found, with its line."""

import json
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import SkipTest

import numpy as np
import pytest

from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.errors import ChoiceError, CodeError
from sweep.testing import PROMISES, assert_keeps, processes
from sweep.testing.compiled import check_steps
from sweep.testing.flights import every_way
from sweep.testing.promises import BROKEN, ELSEWHERE, KEPT, check_all
from sweep.testing.subject import subject
from sweep.trial.result import Result
from sweep.trial.simulation import run
from tests.cases import slow_but
from tests.commands import sweep
from tests.interpreter import interpreted
from tests.testing.models import LINE, doing, inside, promise_of, written

DEF = "def advance(flock, world, params, work, record, rng, steps):"
ONLY_TORUS = """demands=(Demand("borders == 'torus'", "it is no torus"),),"""
ONLY_BOUNDED = ONLY_TORUS.replace("'torus'", "'bounded'")
SIGHT, REACH = "def sight(params):", "def obstacle_reach(params):"
SYMMETRIES = 'symmetries={"translation": {}, "quarter_turn": {}, "permutation": {}},'
GAIN = 'gain: Annotated[float, About("strength of the pull", "1/time^2", low=0)]'


def marked(text: str) -> tuple[str, str]:
    """The edit that marks a line and changes nothing."""
    return text, f"{text}  {LINE}"


def to(text: str, other: str) -> tuple[str, str]:
    """The edit to another text, whose line is marked."""
    return text, f"{other}  {LINE}"


BAD: list[tuple[str, str, tuple[tuple[str, str], ...]]] = [
    ("settings", "has no range", (to(GAIN, 'gain: Annotated[float, About("it")]'),)),
    (
        "settings",
        'has the unknown unit "furlongs"',
        (to(GAIN, 'gain: Annotated[float, About("it", "furlongs", low=0)]'),),
    ),
    (
        "settings",
        "has no text",
        (to(GAIN, 'gain: Annotated[float, About("", low=0)]'),),
    ),
    ("settings", "has no About; write", (to(GAIN, "gain: float"),)),
    (
        "settings",
        "is of type str",
        (to(GAIN, 'gain: Annotated[str, About("it", low=0)]'),),
    ),
    (
        "settings",
        "empty range 2 to 1",
        (to(GAIN, 'gain: Annotated[float, About("it", low=2, high=1)]'),),
    ),
    (
        "settings",
        "all models have",
        (to(GAIN, GAIN.replace("gain", "width")),),
    ),
    (
        "presets",
        'has no value for "gain"',
        (
            ('    "gain": 0.01,\n', ""),
            (
                '    presets={"as_run": PRESET},',
                f'    presets={{"as_run": PRESET}},  {LINE}',
            ),
        ),
    ),
    ("presets", "-1 is not allowed for gain", (to('"gain": 0.01,', '"gain": -1,'),)),
    (
        "presets",
        'which is no parameter; did you mean "gain"',
        (to('"gain": 0.01,', '"gain": 0.01, "gian": 1,'),),
    ),
    (
        "presets",
        "all are blind",
        (
            marked('    presets={"as_run": PRESET},'),
            (
                "    sight=sight,",
                '    sight=sight, demands=(Demand("range > 60", "all are blind"),),',
            ),
        ),
    ),
    (
        "presets",
        "minimum_image needs periodic boundaries",
        (
            marked('    presets={"as_run": PRESET},'),
            ('    "gain": 0.01,', '    "gain": 0.01, "minimum_image": True,'),
        ),
    ),
    (
        "presets",
        'unknown metric "sped"; did you mean "speed"',
        (to('metrics=("speed",),', 'metrics=("sped",),'),),
    ),
    ("presets", "another name", (to('name="drawn",', 'name="nanobot",'),)),
    (
        "allocation",
        "is plain Python; write @jit",
        ((f"@jit\n{DEF}", f"{DEF}  {LINE}"),),
    ),
    (
        "allocation",
        "is compiled with memory",
        ((f"@jit\n{DEF}", f"@jit_with_memory\n{DEF}  {LINE}"),),
    ),
    (
        "allocation",
        "takes 6 arguments, but gets 7",
        (to(DEF, DEF.replace(" rng,", "")),),
    ),
    (
        "allocation",
        "advance returns None",
        (
            marked(DEF),
            (
                "            return False\n    return True\n",
                "            return False\n",
            ),
        ),
    ),
    (
        "allocation",
        "advance took 0 steps of 1",
        (
            marked(DEF),
            ("if not observe(flock, world, record):", "if steps < 0:"),
        ),
    ),
    (
        "grid",
        "advance took 0 steps of",
        (
            marked(DEF),
            ("if not observe(flock, world, record):", "if steps < 0:"),
        ),
    ),
    (
        "calls",
        "but vx before the step was -",
        (marked(DEF), ("        remember(flock, seen)\n", "")),
    ),
    (
        "calls",
        "values of an earlier step; call publish(flock, others, work)",
        (marked(DEF), ("remember(flock, seen)", "remember(flock, flock)")),
    ),
    (
        "calls",
        "boid 0 moves, but stays in the old cell of the grid; call move(work.grid, i",
        (marked(DEF), ("move_all(work.grid, flock)", "pass")),
    ),
    (
        "calls",
        "or move_all(work.grid, flock) at the end of each step (preset as_run, seq",
        (marked(DEF), ("move(work.grid, i, x, y)", "pass")),
    ),
    ("interpreter", "in plain Python", (marked(DEF), doing("vx += 1e-3 * vy**3"))),
    (
        "interpreter",
        "ZeroDivisionError",
        (inside("vx += 1.0 / (1.0 / float(step - step) + 1.0)"),),
    ),
    (
        "grid",
        "sight must declare the longest searched",
        (
            marked(SIGHT),
            (
                "square_range(params.range, False)",
                "square_range(2.5 * params.range, False)",
            ),
        ),
    ),
    (
        "grid",
        "update the grid after each",
        (
            marked(SIGHT),
            ("                move(work.grid, i, x, y)\n", "                pass\n"),
            ("        if not sequential:\n    ", ""),
        ),
    ),
    (
        "restart",
        "keep values only in the flock",
        (marked(DEF), doing("vx += 0.01 * step")),
    ),
    (
        "restart",
        "the last step of a shorter trial",
        (marked(DEF), doing("vx += 0.01 / record.last")),
    ),
    (
        "robots",
        "drives is True, but the source has False",
        (
            to(
                "    sight=sight,",
                "    sight=sight, publishes=False, drives=True, goals_in_turn=False,"
                ' shared=("dt", "gain", "range", "fov"),',
            ),
        ),
    ),
    (
        "motors",
        "advance called drive 130 times in 10 steps of 14 boids",
        (
            marked(DEF),
            (
                "from kernels.rules.borders",
                "from kernels.robots.actuation import drive\n"
                "from kernels.robots.sensing import publish\n"
                "from kernels.rules.borders",
            ),
            ("remember(flock, seen)\n", "publish(flock, seen, work)\n"),
            doing("if i > 0: vx, vy = drive(work, i, seen.vx[i], seen.vy[i], vx, vy)"),
        ),
    ),
    (
        "workers",
        "draw only from rng",
        (marked(DEF), doing("vx += 0.1 * np.random.random()")),
    ),
    (
        "symmetries",
        '"translation" is broken',
        (marked(SYMMETRIES), doing("vx -= 0.01 * x")),
    ),
    (
        "symmetries",
        '"quarter_turn" is broken',
        (to(SYMMETRIES, 'symmetries={"quarter_turn": {}},'), doing("vx += 0.1")),
    ),
    (
        "symmetries",
        '"reflection" is broken',
        (
            to(SYMMETRIES, 'symmetries={"rotation": {}, "reflection": {}},'),
            doing("vx, vy = vx - 0.1 * vy, vy + 0.1 * vx"),
        ),
    ),
    (
        "symmetries",
        '"permutation" is broken',
        (
            marked(SYMMETRIES),
            doing("vx, vy = vx + 0.001 * i * vy, vy - 0.001 * i * vx"),
        ),
    ),
    (
        "symmetries",
        'unknown symmetry "transaltion"; did you mean "translation"',
        (to(SYMMETRIES, 'symmetries={"transaltion": {}},'),),
    ),
    (
        "symmetries",
        "write symmetries as",
        (to(SYMMETRIES, 'symmetries=("translation",),'),),
    ),
    (
        "symmetries",
        "-1 is not allowed for gain",
        (to(SYMMETRIES, 'symmetries={"translation": {"gain": -1}},'),),
    ),
    (
        "symmetries",
        'unknown parameter "gian"; did you mean "gain"',
        (to(SYMMETRIES, 'symmetries={"translation": {"gian": 0}},'),),
    ),
    (
        "reach",
        "farther away than sight declares, 50,",
        (
            marked(SIGHT),
            doing("for j in range(flock.x.size): vx += 1e-4 * (seen.x[j] - x)"),
        ),
    ),
    (
        "reach",
        "and torus, perceived across borders",
        (
            marked(SIGHT),
            ('    "gain": 0.01,', '    "gain": 0.01, "borders": "torus",'),
            ("sight=sight,", f"sight=sight, {ONLY_TORUS}"),
            ("return Sight(params.range,", "return Sight(params.range / 2,"),
        ),
    ),
    (
        "reach",
        "outside the cone that sight declares, 90 degrees,",
        (
            marked(SIGHT),
            (
                "return Sight(params.range, params.fov)",
                "return Sight(params.range, 90.0)",
            ),
        ),
    ),
    (
        "reach",
        "obstacle_reach declares, 25,",
        (
            marked(REACH),
            (
                "work.reach, params.range / 2, x, y",
                "work.reach, 3 * params.range, x, y",
            ),
        ),
    ),
    (
        "grid",
        "ValueError: too far",
        (to("return Sight(params.range, params.fov)", 'raise ValueError("too far")'),),
    ),
]


IN_OTHER_PROCESSES = ("interpreter", "workers")
"""These take long. The command tries them too, with all others."""


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the good model, which is compiled once for all promises."""
    return written(tmp_path_factory.mktemp("good"))[0]


@pytest.mark.parametrize(
    "promise",
    slow_but([one for one in PROMISES if one not in IN_OTHER_PROCESSES], PROMISES),
)
def test_a_good_model_keeps_it(promise: str, good: Path) -> None:
    assert_keeps(good, promise)


@dataclass
class OtherWorkers:
    """What stands for workers: each of their results is that of `trial`."""

    trial: Callable[[Job], Result]

    def start(self) -> "OtherWorkers":
        return self

    def stop(self) -> None:
        pass

    def map(self, _run: object, jobs: Iterable[Job]) -> Iterator[Result]:
        return map(self.trial, jobs)


def elsewhere(job: Job) -> Result:
    """The result of a trial of which a place is off by the last bit."""
    result = run(job)
    bodies = result.trajectory.copy()
    bodies[-1, 0, 0] = np.nextafter(bodies[-1, 0, 0], math.inf)
    return replace(result, trajectory=bodies)


def lost(job: Job) -> Result:
    """The result of a trial that fails elsewhere."""
    return replace(run(job), status="failed", error="no room\nin line 3")


@pytest.mark.parametrize(
    ("trial", "words"),
    [
        (run, ""),
        (elsewhere, "a trial has other positions in one process than in two (pre"),
        (lost, "a trial is done in one process, but failed in two: no room (pre"),
    ],
)
def test_results_of_workers_are_compared_with_those_of_this_process(
    trial: Callable[[Job], Result], words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """That worker processes have the same results is shown by tests/workers."""
    monkeypatch.setattr(processes, "Loky", lambda _workers: OtherWorkers(trial))
    if not words:
        return assert_keeps("nanobot", "workers")
    with pytest.raises(AssertionError) as broken:
        assert_keeps("nanobot", "workers")
    assert words in str(broken.value)
    assert "draw only from rng" in str(broken.value)
    return None


FLOWN = ("calls", "grid", "restart", "motors", "symmetries", "reach")
"""Promises that are tried in flights, which need no compiler."""
LONG = {
    "advance returns None",
    "advance took 0 steps of 1",
    "in plain Python",
    "draw only from rng",
}
"""What is said of breaches of other promises whose models are compiled, in some 3 s
each, where another breach of the same promise is in the fast suite, or processes are
started.
"""
FAST = [one for one in BAD if one[0] not in FLOWN and one[1] not in LONG]


@pytest.mark.parametrize(("promise", "words", "edits"), slow_but(FAST, BAD))
def test_a_model_that_breaks_it_is_found_with_its_line(
    promise: str, words: str, edits: tuple[tuple[str, str], ...], tmp_path: Path
) -> None:
    path, line = written(tmp_path, *edits)
    with pytest.raises(AssertionError) as broken:
        assert_keeps(path, promise)
    _is_found(str(broken.value), line, words)


def _is_found(said: str, line: int, words: str) -> None:
    assert said.startswith(f"drawn.py, line {line}")
    assert words in said
    assert "\n" not in said


IN_THE_INTERPRETER = [one for one in BAD if one[0] in FLOWN]
MANY_BOIDS = "update the grid after each"
"""What is said of a breach that is found in a flock of many boids."""


@pytest.mark.parametrize(
    ("promise", "words", "edits"),
    slow_but(
        [one for one in IN_THE_INTERPRETER if one[1] != MANY_BOIDS], IN_THE_INTERPRETER
    ),
)
def test_it_is_found_in_the_interpreter_too(
    promise: str, words: str, edits: tuple[tuple[str, str], ...], tmp_path: Path
) -> None:
    path, line = written(tmp_path, *edits)
    _is_found(_said_there(path, promise, AssertionError), line, words)


def _said_there(path: Path, promise: str, error: type[BaseException]) -> str:
    """The error of a promise where nothing is compiled."""
    code = (
        "from pathlib import Path\n"
        f"from {error.__module__} import {error.__name__}\n"
        "from sweep.testing import assert_keeps\n"
        "try:\n"
        f"    assert_keeps(Path({str(path)!r}), {promise!r})\n"
        f"except {error.__name__} as error:\n"
        "    print(error)"
    )
    return interpreted(code).rstrip("\n")


@pytest.mark.slow
def test_boids_that_stay_need_not_be_told_to_the_grid(tmp_path: Path) -> None:
    """Nor any, where nobody searches."""
    stays = doing("if i % 2 == 0: continue")
    assert_keeps(written(tmp_path, stays)[0], "calls")
    untold = (
        ("move_all(work.grid, flock)", "pass"),
        ("move(work.grid, i, x, y)", "pass"),
    )
    blind = ("            found = search(seen,", "            found = 0 * search(seen,")
    assert_keeps(written(tmp_path, blind, *untold)[0], "calls")


@pytest.mark.slow
def test_memory_is_counted_where_numba_does_not_refuse_it(tmp_path: Path) -> None:
    """By the blocks that 398 steps take more than one step does."""
    advance = ("@jit\ndef advance", "@jit_with_memory\ndef advance")
    about = subject(written(tmp_path, advance, doing("vx += np.zeros(3)[0]"))[0])
    job = next(every_way(about, n=20, steps=400))
    with pytest.raises(AssertionError, match="398 steps have allocated 7,940 blocks"):
        check_steps(about, job)


@pytest.mark.parametrize(
    ("promise", "why", "edits"),
    [
        (
            "restart",
            "in the small test worlds, it is small",
            (
                (
                    "    sight=sight,",
                    '    sight=sight, demands=(Demand("width > 399", "it is small"),),',
                ),
            ),
        ),
        ("robots", "declares no abilities of robots: add publishes=False", ()),
        ("motors", "for actuation before confine write `vx, vy = drive", ()),
        ("symmetries", "model declares no symmetry", ((f"    {SYMMETRIES}\n", ""),)),
        (
            "grid",
            "boids perceive all boids",
            (("return Sight(params.range, params.fov)", "return Sight(math.inf)"),),
        ),
        (
            "reach",
            "the model runs in no open world and in no periodic world",
            (("sight=sight,", f"sight=sight, {ONLY_BOUNDED}"),),
        ),
        (
            "reach",
            "boids perceive all boids",
            (
                ("return Sight(params.range, params.fov)", "return Sight(math.inf)"),
                ("return params.range / 2", "return math.inf"),
            ),
        ),
    ],
)
def test_what_does_not_apply_is_skipped_with_the_reason(
    promise: str, why: str, edits: tuple[tuple[str, str], ...], tmp_path: Path
) -> None:
    assert why in _said_there(written(tmp_path, *edits)[0], promise, SkipTest)


@pytest.mark.parametrize("promise", IN_OTHER_PROCESSES)
def test_a_model_that_other_processes_cannot_find_is_skipped(promise: str) -> None:
    model = MODELS["nanobot"]._replace(name="mine")
    with pytest.raises(SkipTest, match="file"):
        assert_keeps(model, promise)


@pytest.mark.slow
def test_without_what_others_need_they_are_not_tried(tmp_path: Path) -> None:
    ending = "            return False\n    return True\n"
    path, _ = written(tmp_path, (ending, "            return False\n"))
    found = {kept.promise: (kept.status, kept.why) for kept in check_all(subject(path))}
    assert tuple(found) == PROMISES
    assert found["presets"] == (KEPT, "")
    assert found["allocation"][0] == BROKEN
    assert found["workers"] == (ELSEWHERE, '"allocation" must be kept first')


def test_what_is_no_model_is_refused(tmp_path: Path) -> None:
    with pytest.raises(
        ChoiceError, match='unknown model "nanobat"; did you mean "nano'
    ):
        assert_keeps("nanobat", "grid")
    with pytest.raises(ValueError, match="no promise 'gird'; allowed: settings,"):
        assert_keeps("nanobot", "gird")
    with pytest.raises(CodeError, match="no such file"):
        assert_keeps(tmp_path / "nothing.py", "grid")
    with pytest.raises(CodeError, match="OTHER is no Model"):
        assert_keeps(f"{written(tmp_path)[0]}:OTHER", "grid")


def test_the_command_says_each_promise_in_a_line(tmp_path: Path) -> None:
    path, line = written(tmp_path, inside("vx += params.gian"))
    done = sweep(tmp_path, "check", path.name)
    assert (done.returncode, done.stderr) == (1, "")
    lines = done.stdout.splitlines()
    assert list(map(promise_of, lines)) == list(PROMISES)
    assert f'drawn.py, line {line}, "vx += params.gian' in done.stdout
    as_json = sweep(tmp_path, "check", path.name, "--json")
    assert as_json.returncode == 1
    assert [one["promise"] for one in json.loads(as_json.stdout)] == list(PROMISES)


@pytest.mark.slow
def test_the_command_ends_with_0_where_nothing_is_broken(tmp_path: Path) -> None:
    path, _ = written(tmp_path)
    done = sweep(tmp_path, "check", f"{path.name}:MODEL", "--json")
    assert done.returncode == 0
    found = {one["promise"]: one["status"] for one in json.loads(done.stdout)}
    others = {found.pop(name) for name in ("robots", "motors", "device")}
    assert others == {ELSEWHERE}
    assert set(found.values()) == {KEPT}


def test_the_command_refuses_what_is_no_model(tmp_path: Path) -> None:
    done = sweep(tmp_path, "check", "vortex.py")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "vortex.py: no such file\n"
