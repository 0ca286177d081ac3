"""What a model or a metric must do, and what is said before any trial where it does
not.
"""

from pathlib import Path

import pytest

from sweep.campaigns.plan import plan_of
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.own_code.sources import gather
from tests import ROOT
from tests.cases import slow_but

VORTEX = (ROOT / "examples" / "vortex.py").read_text()
METRIC = '''
from kernels.jit import jit
from kernels.metrics import Metric


@jit
def charge(frames, filled, ground, observation, values):
    """The number of a frame."""
    for f in range(filled):
        values[f] = float(f)


METRICS = {"charge": Metric(charge, "", "the number of a frame", "a test")}
'''
MAP = '''
import numpy as np
from kernels.worlds import Map


def wall(settings, rng):
    """A wall."""
    return np.array([[50.0, 50.0, 9.0, 9.0, 0.0]])


MAPS = {"wall": Map(wall, "a wall", "a test")}
'''
SPEC = """
study: mine
model: ./vortex.py
preset: standard
fixed: {n: 12, steps: 9, map: ./wall.py}
replicates: 2
seed: 5
record: {metrics: [speed, ./charge.py]}
"""
OBSERVE = """        if not observe(flock, world, record):
            return False
"""
WRONG = {
    "observes each boid": (
        "vortex.py",
        f"        move_all(work.grid, flock)\n{OBSERVE}",
        """            move_all(work.grid, flock)
            if not observe(flock, world, record):
                return False
""",
        "advance took 12 steps of 1; call observe once in each",
    ),
    "observes nothing": (
        "vortex.py",
        OBSERVE,
        "",
        "advance took 0 steps of 1; call observe once in each",
    ),
    "returns nothing": (
        "vortex.py",
        f"{OBSERVE}    return True\n",
        OBSERVE,
        "advance returns None: it must return True, or False after a step whose",
    ),
    "is not compiled": (
        "vortex.py",
        "@jit\ndef advance",
        "def advance",
        "advance is not compiled: write @jit above it",
    ),
    "takes one argument less": (
        "vortex.py",
        "    _rng: Generator,\n",
        "",
        "the advance of vortex, takes 6 arguments, but gets 7: flock, world, params,",
    ),
    "draws from numpy": (
        "vortex.py",
        "            ax = ",
        "            ax = np.random.uniform(-1.0, 1.0) + ",
        "two runs of one trial differ after a step, in flock.x: draw random numbers",
    ),
    "sees a number": (
        "vortex.py",
        "return Sight(params.perception_range)",
        "return params.perception_range",
        "sight of vortex returns 200.0; allowed: a Sight",
    ),
    "sees what is not there": (
        "vortex.py",
        "return Sight(params.perception_range)",
        "return Sight(params.reach)",
        "sight of vortex, standard: AttributeError: 'Params' object has no attribute",
    ),
    "a metric writes nothing": (
        "charge.py",
        "values[f] = float(f)",
        "x = float(f)",
        "metric charge writes no number into values[f] of some frame",
    ),
    "a metric returns": (
        "charge.py",
        "values[f] = float(f)",
        "return float(f)",
        "metric charge writes no number into values[f] of some frame",
    ),
    "a metric is not compiled": (
        "charge.py",
        "@jit",
        "",
        "line 7: charge is not compiled: write @jit above it",
    ),
    "a metric takes fewer": (
        "charge.py",
        "observation, values)",
        "values)",
        "takes 4 arguments, but gets 5: frames, filled, ground, observation, values",
    ),
    "a metric is better somehow": (
        "charge.py",
        '"a test")',
        '"a test", "+")',
        'metric "charge" has better="+"; allowed: "high", "low", "neither"',
    ),
    "a metric is distributed somehow": (
        "charge.py",
        '"a test")',
        '"a test", distribution="rare")',
        'metric "charge" has distribution="rare"; allowed: "normal", "skewed", "count",'
        ' "proportion", "percentage"',
    ),
    "a metric has a range that is none": (
        "charge.py",
        '"a test")',
        '"a test", low=1.0, high=0.0)',
        'metric "charge" has low=1.0 and high=0.0; allowed: two numbers, the lower'
        " first",
    ),
    "a metric has a range of no numbers": (
        "charge.py",
        '"a test")',
        '"a test", low="0")',
        "metric \"charge\" has low='0' and high=inf; allowed: two numbers, the lower"
        " first",
    ),
    "a map of another shape": (
        "wall.py",
        "9.0, 9.0, 0.0",
        "9.0, 9.0",
        "map wall draws an array of shape (1, 4): it must be (M, 5) or (M, 7), of"
        " finite numbers",
    ),
    "a map that cannot be drawn": (
        "wall.py",
        "np.array([[50.0",
        "np.array([[settings.breadth",
        "wall.py, line 8: AttributeError: 'WorldSettings' object has no attribute",
    ),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    imports = "import numpy as np\nfrom numpy.random import Generator\n"
    text = VORTEX.replace("from numpy.random import Generator\n", imports)
    for name, code in (("vortex", text), ("charge", METRIC), ("wall", MAP)):
        (tmp_path / f"{name}.py").write_text(code)
    (tmp_path / "spec.yaml").write_text(SPEC)
    return tmp_path


def planned(folder: Path) -> None:
    plan_of(load_spec(folder / "spec.yaml"), 1)


@pytest.mark.slow
def test_what_is_right_is_planned(folder: Path) -> None:
    planned(folder)


LONG = {
    *("observes each boid", "observes nothing", "returns nothing"),
    *("a metric returns", "draws from numpy"),
}
"""Of those above; each is compiled in some 3 s, and others are of the same kind, or
among the fast ones of `tests/testing/test_promises.py`.
"""


@pytest.mark.parametrize("name", slow_but(WRONG.keys() - LONG, WRONG))
def test_what_is_wrong_is_a_sentence_before_any_trial(name: str, folder: Path) -> None:
    file, old, new, sentence = WRONG[name]
    path = folder / file
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(SpecError) as caught:
        planned(folder)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("spec.yaml:")


@pytest.mark.slow
def test_what_keeps_its_last_states_may_not_ask_how_many_steps_are_left(
    folder: Path,
) -> None:
    pull = "ax = robot.cohesion_weight * pull_x"
    text = (folder / "vortex.py").read_text()
    assert pull in text
    slower = text.replace(pull, f"{pull} * (1.0 - record.progress[0] / record.last)")
    (folder / "vortex.py").write_text(slower)
    planned(folder)
    keeping = SPEC.replace("charge.py]", "charge.py], last_states: true")
    (folder / "spec.yaml").write_text(f"{keeping}streams: {{noise: common}}\n")
    with pytest.raises(SpecError, match="no value may depend on the number of steps"):
        planned(folder)
    (folder / "vortex.py").write_text(text)
    planned(folder)


@pytest.mark.parametrize(
    ("file", "line"), [("vortex.py", 3), ("wall.py", 5), ("charge.py", 8)]
)
def test_a_mistake_has_the_line_of_the_spec_that_names_the_file(
    file: str, line: int, folder: Path
) -> None:
    for wrong in ("1 / 0", "from . import nowhere"):
        text = (folder / file).read_text()
        (folder / file).write_text(f"{text}\n{wrong}\n")
        with pytest.raises(SpecError) as caught:
            planned(folder)
        (folder / file).write_text(text)
        assert str(caught.value).startswith(f"spec.yaml:{line}: {file}, line ")


def test_sources_are_bounded_together(folder: Path) -> None:
    for name in ("a", "b", "c"):
        (folder / f"{name}.py").write_text(f"TEXT = '{name * 900_000}'\n")
    with pytest.raises(Exception, match="the files have more than 2,000,000 bytes"):
        gather(folder, ["a.py", "b.py", "c.py"])
