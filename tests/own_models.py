"""A small study with code of one's own: files beside its spec, as a user has them.

The model is `examples/vortex.py` with another name, two presets, and a rule in a file
of its own. So that one computes the same numbers.
"""

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

from tests.other_packages import VORTEX

PRESET = '\nAS_RUN = STANDARD | {"swirl_weight": 0.02}\n'
MODEL = (
    VORTEX.replace('name="vortex"', 'name="drawn"')
    .replace("from kernels.rules.social import cohesion", "from .rules import cohesion")
    .replace('{"standard": STANDARD}', '{"as_written": STANDARD, "as_run": AS_RUN}')
    .replace("\n\n\ndef sight", f"{PRESET}\n\ndef sight")
)
RULES = '''"""Rules of one's own."""

from kernels.jit import jit
from kernels.near import Near
from kernels.rules import social

SIGN = 1.0


@jit
def cohesion(near: Near, found: int, range2: float) -> tuple[float, float]:
    """As the rule of that name, with a sign."""
    x, y = social.cohesion(near, found, range2)  # towards the others
    return SIGN * x, SIGN * y
'''
METRICS = '''"""A metric of one's own."""

from kernels.jit import jit
from kernels.metrics import Metric


@jit
def rightwards(frames, filled, ground, observation, values):
    """Mean x component of the velocity."""
    for f in range(filled):
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            total += frames.bodies[f, 2, i]
        values[f] = total / frames.bodies.shape[2]


METRICS = {
    "rightwards": Metric(
        rightwards, "length/time", "mean velocity to the right", "a test"
    )
}
'''
MAPS = '''"""A map of one's own."""

import numpy as np

from kernels.worlds import Map


def pillar(settings, rng):
    """One disc in the middle."""
    return np.array([[settings.width / 2, settings.height / 2, 9.0, 9.0, 1.0]])


MAPS = {"pillar": Map(pillar, "a pillar in the middle", "a test")}
'''
SPEC = """
study: drawn
model: ./drawn.py
preset: as_run
fixed: {n: 12, steps: 9, map: ./places.py}
sweep: {cohesion_weight: [0.01, 0.02]}
replicates: 3
seed: 5
record: {metrics: [./mine.py], series: [speed, rightwards], every: 2}
"""
FILES = {
    "drawn.py": MODEL,
    "rules.py": RULES,
    "mine.py": METRICS,
    "places.py": MAPS,
    "drawn.yaml": SPEC,
}
OTHER_RULE = ("SIGN = 1.0", "SIGN = -1.0")
OTHER_WORDS = (
    ('"""As the rule of that name, with a sign."""', '"""That rule, and a sign."""'),
    ("  # towards the others", ""),
)
OTHER_METRIC = ("frames.bodies[f, 2, i]", "2.0 * frames.bodies[f, 2, i]")


def written(folder: Path, *changes: tuple[str, str], spec: str = SPEC) -> Path:
    """The spec in a folder, with the files that it names beside it. Each change is a
    text in one of the files, and another in its place.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (FILES | {"drawn.yaml": spec}).items():
        (folder / name).write_text(text)
    for old, new in changes:
        edited(folder, old, new)
    return folder / "drawn.yaml"


def edited(folder: Path, old: str, new: str) -> None:
    """Put a text in the place of another, which one of the files has."""
    [path] = [one for one in folder.iterdir() if one.is_file() and old in _text(one)]
    path.write_text(_text(path).replace(old, new))


@cache
def at_hand() -> Path:
    """The same in a folder of this process, for specs that are texts."""
    folder = Path(tempfile.mkdtemp(prefix="boidsweep-own-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return written(folder)


def _text(path: Path) -> str:
    return path.read_text() if path.name in FILES else ""
