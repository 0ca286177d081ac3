"""Packages of others that offer entries, as a package manager leaves them."""

from pathlib import Path

from tests import ROOT

VORTEX = (ROOT / "examples" / "vortex.py").read_text()
MODEL = VORTEX.replace('name="vortex"', 'name="swirl"').replace(
    "from kernels.rules.social import cohesion", "from swirling.rules import cohesion"
)
RULES = '''"""Rules of one's own."""

from kernels.jit import jit
from kernels.near import Near
from kernels.rules import social

SIGN = 1.0


@jit
def cohesion(near: Near, found: int, range2: float) -> tuple[float, float]:
    """As the rule of that name, with a sign."""
    x, y = social.cohesion(near, found, range2)
    return SIGN * x, SIGN * y
'''
ENTRIES = '''"""A metric, a map, a start, a sampler and a kind of figure."""

import numpy as np
from kernels.jit import jit
from kernels.metrics import Metric
from kernels.starts import STARTS
from kernels.worlds import Map
from sweep.figures.planning import FigureKind, Planned
from sweep.spec.sampling import Sampler


@jit
def rightwards(frames, filled, ground, observation, values):
    """Mean x component of the velocity."""
    for f in range(filled):
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            total += frames.bodies[f, 2, i]
        values[f] = total / frames.bodies.shape[2]


def pillar(settings, rng):
    """One disc in the middle."""
    return np.array([[settings.width / 2, settings.height / 2, 9.0, 9.0, 1.0]])


def still(n, settings, world, contact, rng, seed):
    """The usual places, at rest."""
    flock = STARTS["numpy"].draw(n, settings, world, contact, rng, seed)
    flock.vx[:] = flock.vy[:] = 0.0
    return flock


def evenly(cube):
    """The same number for all settings of a point."""
    unit = (np.arange(cube.points) + 0.5) / cube.points
    return [unit.copy() for _ in cube.names]


METRIC = Metric(rightwards, "length/time", "mean velocity to the right", "a test")
MAP = Map(pillar, "a pillar in the middle", "a test")
START = STARTS["numpy"]._replace(draw=still, text="at rest")
SAMPLER = Sampler(evenly, "the diagonal")


def plan(study, choices):
    """A figure without anything."""
    from matplotlib.figure import Figure

    return [Planned("", Figure)]


KIND = FigureKind("nothing at all", (), plan)
'''
OFFERED = {
    "boidsweep.models": {"swirl": "swirling.model:MODEL"},
    "boidsweep.metrics": {"rightwards": "swirling.entries:METRIC"},
    "boidsweep.maps": {"pillar": "swirling.entries:MAP"},
    "boidsweep.starts": {"still": "swirling.entries:START"},
    "boidsweep.samplers": {"evenly": "swirling.entries:SAMPLER"},
    "boidsweep.figures": {"nothing": "swirling.entries:KIND"},
}
FILES = {
    "__init__.py": "",
    "model.py": MODEL,
    "rules.py": RULES,
    "entries.py": ENTRIES,
}


def install(
    folder: Path,
    offered: dict[str, dict[str, str]],
    files: dict[str, str],
    *,
    name: str = "swirling",
) -> Path:
    """A folder of installed packages below `folder`, with one more that has these
    `files` and offers these entries by group.
    """
    packages = folder / "site-packages"
    package, about = packages / name, packages / f"{name}-1.0.dist-info"
    package.mkdir(parents=True, exist_ok=True)
    about.mkdir(exist_ok=True)
    for file, text in files.items():
        (package / file).write_text(text)
    (about / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"
    )
    groups = [
        f"[{group}]\n" + "".join(f"{one} = {place}\n" for one, place in entries.items())
        for group, entries in offered.items()
    ]
    (about / "entry_points.txt").write_text("\n".join(groups))
    return packages
