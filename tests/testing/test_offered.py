"""What else a file offers: good metrics, maps, starts and samplers keep all promises,
and a bad one is found, with its line.
"""

from pathlib import Path
from unittest import SkipTest

import pytest

from sweep.testing import PROMISES, assert_offers
from sweep.testing.entrants import Entrant, entrants
from sweep.testing.promises import OFFERED
from tests import ROOT
from tests.cases import slow_but
from tests.commands import sweep
from tests.testing.models import promise_of

GOOD = '''"""One entry of each kind."""

import math
import os

import numpy as np

from kernels.jit import jit, jit_with_memory
from kernels.metrics import Metric
from kernels.recording import FIRST_STATE
from kernels.settings import Demand
from kernels.starts import Start
from kernels.state import empty_flock
from kernels.worlds import Map
from sweep.spec.sampling import Sampler

SEEN = []


@jit
def gain(frames, filled, ground, observation, values):
    for f in range(filled):
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            total += frames.bodies[f, 0, i] * (1.0 + ground.kind[i])
            total += frames.bodies[f, FIRST_STATE, i]
        pass
        values[f] = total / ground.boids


def discs(settings, rng):
    x = rng.uniform(0.0, settings.width, 4)
    y = np.full(4, settings.height / 2)
    return np.column_stack([x, y, np.ones(4), np.ones(4), np.ones(4)])


def rows(n, settings, world, contact, rng, seed):
    flock = empty_flock(n)
    flock.x[:] = rng.uniform(0.0, world.width, n)
    flock.vx[:] = settings.start_speed
    return flock


def draw(cube):
    return [cube.generator(name).random(cube.points) for name in cube.names]


METRICS = {
    "gain": Metric(
        gain, "length", "a mean", "a test", state=("phase",), kinds=("a", "b")
    )
}
MAPS = {"discs": Map(discs, "four discs", "a test", random=True)}
STARTS = {"rows": Start(rows, "on a line", "a test")}
SAMPLERS = {"evenly": Sampler(draw, "by chance")}
'''
ENTRIES = ("metric gain", "map discs", "start rows", "sampler evenly")
OTHERS = ("METRICS", "STARTS", "SAMPLERS")
GAIN, DISCS = "def gain(", "def discs("
ROWS, DRAW = "def rows(", "def draw("

BAD: list[tuple[str, str, str, str, tuple[str, str]]] = [
    ("metric gain", "described", GAIN, "has no text", ('"a mean"', '" "')),
    (
        "metric gain",
        "allocation",
        GAIN,
        "measure is compiled with memory",
        ("@jit\n", "@jit_with_memory\n"),
    ),
    (
        "metric gain",
        "values",
        GAIN,
        "the metric changes frames",
        ("        pass\n", "        frames.bodies[f, 1, 0] = 0.0\n"),
    ),
    (
        "metric gain",
        "values",
        GAIN,
        "the metric writes values beyond the last frame",
        ("        pass\n", "        values[filled] = 0.0\n"),
    ),
    (
        "metric gain",
        "values",
        GAIN,
        "the metric does not write the value of frame 3 of 11",
        ("        pass\n", "        if f == 3:\n            continue\n"),
    ),
    (
        "metric gain",
        "values",
        GAIN,
        "frame 1 has the value ",
        ("        pass\n", "        total += frames.bodies[0, 0, 0]\n"),
    ),
    (
        "metric gain",
        "values",
        GAIN,
        "but up to -1 is declared",
        ('kinds=("a", "b")', 'kinds=("a", "b"), high=-1.0'),
    ),
    (
        "metric gain",
        "interpreter",
        GAIN,
        "in plain Python",
        ("        pass\n", "        total += (0.1 * total) ** 3\n"),
    ),
    (
        "metric gain",
        "interpreter",
        "float(f - f)",
        "ZeroDivisionError",
        ("        pass\n", "        total += 0.0 / (1.0 / float(f - f) + 1.0)\n"),
    ),
    (
        "map discs",
        "bounds",
        DISCS,
        "is outside the world of",
        ("0.0, settings.width, 4", "2 * settings.width, 3 * settings.width, 4"),
    ),
    (
        "map discs",
        "bounds",
        DISCS,
        "the last column is neither 0 nor 1",
        ("np.ones(4)])", "np.full(4, 2)])"),
    ),
    (
        "map discs",
        "bounds",
        DISCS,
        "a negative half-width",
        ("[x, y, np.ones(4)", "[x, y, -np.ones(4)"),
    ),
    ("map discs", "seeds", DISCS, "random=True", (", random=True", "")),
    (
        "map discs",
        "repeats",
        DISCS,
        "other values the second time",
        ("    x = rng", "    SEEN.append(0)\n    x = len(SEEN) / 1e6 + 0.9 * rng"),
    ),
    (
        "start rows",
        "bounds",
        ROWS,
        "begins at (",
        ("rng.uniform(0.0, world.width, n)", "-1.0"),
    ),
    (
        "start rows",
        "bounds",
        ROWS,
        "the flock has 15 boids, but n is 14",
        (
            "empty_flock(n)\n    flock.x[:] = rng.uniform(0.0, world.width, n)",
            "empty_flock(n + 1)",
        ),
    ),
    (
        "start rows",
        "bounds",
        ROWS,
        "a position or a velocity is not finite",
        ("= settings.start_speed", "= math.nan"),
    ),
    (
        "start rows",
        "repeats",
        ROWS,
        "other values the second time",
        (
            "    return flock",
            "    SEEN.append(0)\n    flock.y[:] = 1 / len(SEEN)\n    return flock",
        ),
    ),
    (
        "start rows",
        "repeats",
        ROWS,
        "in another process",
        ("    return flock", "    flock.x[:] /= os.getpid()\n    return flock"),
    ),
    (
        "sampler evenly",
        "bounds",
        DRAW,
        "allowed: from 0 to below 1",
        ("[cube.generator(name)", "[1 + cube.generator(name)"),
    ),
    (
        "sampler evenly",
        "bounds",
        DRAW,
        "draw gives 2 numbers",
        ("in cube.names]", "in cube.names[:2]]"),
    ),
]


def written(folder: Path, *edits: tuple[str, str]) -> Path:
    """The good file with some texts replaced, each of which it has once."""
    text = GOOD
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path = folder / "mine.py"
    path.write_text(text, encoding="utf-8")
    return path


def entry(path: Path, of: str) -> Entrant:
    [one] = [one for one in entrants(str(path)) if one.words == of]
    return one


def test_good_entries_keep_all_promises(tmp_path: Path) -> None:
    written(tmp_path)
    done = sweep(tmp_path, "check", "mine.py")
    assert (done.returncode, done.stderr) == (0, "")
    expected = []
    for of, kind in zip(ENTRIES, OFFERED, strict=True):
        expected += [of, *(f"kept {promise}" for promise in OFFERED[kind])]
    assert [" ".join(line.split()[:2]) for line in done.stdout.splitlines()] == expected


@pytest.mark.parametrize(
    ("of", "promise", "line", "words", "edit"),
    slow_but([one for one in BAD if one[3] != "in plain Python"], BAD),
)
def test_an_entry_that_breaks_a_promise_is_found_with_its_line(
    of: str, promise: str, line: str, words: str, edit: tuple[str, str], tmp_path: Path
) -> None:
    path = written(tmp_path, edit)
    one = entry(path, of)
    lines = path.read_text().splitlines()
    [number] = [place for place, text in enumerate(lines, 1) if line in text]
    with pytest.raises(AssertionError) as broken:
        OFFERED[one.kind][promise].check(one)
    said = str(broken.value)
    assert said.startswith(f"mine.py, line {number}")
    assert words in said
    assert "\n" not in said


def test_authors_are_told_by_an_assertion(tmp_path: Path) -> None:
    maps_alone = [(f"{name} = {{", f"OTHER_{name} = {{") for name in OTHERS]
    assert_offers(written(tmp_path, *maps_alone))
    with pytest.raises(AssertionError, match=r"mine\.py, line \d+: map discs has no"):
        assert_offers(written(tmp_path, *maps_alone, ('"four discs"', '" "')))


def test_the_command_says_each_promise_of_an_entry_in_a_line(tmp_path: Path) -> None:
    maps_alone = [(f"{name} = {{", f"OTHER_{name} = {{") for name in OTHERS]
    written(tmp_path, *maps_alone, (", random=True", ""))
    done = sweep(tmp_path, "check", "mine.py")
    assert (done.returncode, done.stderr) == (1, "")
    heading, *lines = done.stdout.splitlines()
    assert heading == "map discs"
    assert [line.split()[:2] for line in lines] == [
        ["kept", "described"],
        ["kept", "bounds"],
        ["broken", "seeds"],
        ["kept", "repeats"],
    ]


def test_what_a_file_demands_of_settings_is_heeded(tmp_path: Path) -> None:
    """A start that small worlds do not suit is not tried."""
    demand = 'demands=(Demand("n > 99", "it is small"),)'
    path = written(tmp_path, ('"on a line", "a test")', f'"a", "a test", {demand})'))
    one = entry(path, "start rows")
    with pytest.raises(SkipTest, match="in the small test worlds, it is small"):
        OFFERED["starts"]["bounds"].check(one)


@pytest.mark.slow
def test_the_command_checks_a_model_and_what_else_its_file_offers(
    tmp_path: Path,
) -> None:
    model = (ROOT / "examples" / "vortex.py").read_text()
    (tmp_path / "both.py").write_text(f"{model}\n\n{GOOD.partition('SAMPLERS')[0]}")
    done = sweep(tmp_path, "check", "both.py")
    assert (done.returncode, done.stderr) == (0, "")
    lines = done.stdout.splitlines()
    headings = [line for line in lines if line in ENTRIES]
    assert headings == list(ENTRIES[:3])
    assert [promise_of(line) for line in lines[: len(PROMISES)]] == list(PROMISES)
    assert lines[len(PROMISES)] == headings[0]


def test_a_file_without_anything_is_refused(tmp_path: Path) -> None:
    (tmp_path / "bare.py").write_text("X = 1\n")
    done = sweep(tmp_path, "check", "bare.py")
    assert (done.returncode, done.stdout) == (2, "")
    assert "bare.py: MODEL is no Model; the file has no Model" in done.stderr
    with pytest.raises(ValueError, match="no METRICS, MAPS, STARTS or SAMPLERS"):
        assert_offers(tmp_path / "bare.py")
