"""Small studies that figures are drawn of."""

import atexit
from collections.abc import Callable
from functools import cache
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from sweep.campaigns.launching import launch
from sweep.own_code.reading import with_variants
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.sampled import MadeUp, axes_of, ishigami, study_of
from tests.searches import TINY, asked_by, edited
from tests.studies import COVERING, SMALL, launched

GRID = """
study: grid
model: nguyen2024
preset: as_run
fixed: {n: 12, steps: 8}
sweep:
  separation_weight: [0.5, 1, 2]
  alignment_weight: [0.01, 0.1, 1]
  borders: [torus, bounded]
replicates: 3
seed: 5
record: {metrics: [speed, dispersion], series: [speed, flock_radius], every: 2}
"""

DRAWN = """
study: drawn
model: nguyen2024
preset: as_run
fixed: {steps: 4}
sweep:
  n: [6, 12]
  weights:
    sample: random
    points: 30
    separation_weight: {uniform: [0, 2]}
    alignment_weight: {uniform: [0, 2]}
    cohesion_weight: {loguniform: [0.01, 10]}
replicates: 2
seed: 5
record: {metrics: [speed, dispersion]}
"""

FLYING = SMALL.replace("study: small", "study: flying").replace(
    "every: 2", "every: 3, trajectories: true"
)
ABLATED = SMALL.replace("study: small", "study: ablated").replace(
    "  separation_weight: [0.5, 1]", "  detail: {ablate: as_written}"
)
SEARCHED = edited(
    TINY,
    ("study: tiny", "study: searched"),
    (
        "flock_radius: {minimize: mean}",
        "flock_radius: {minimize: mean}\n    speed: {maximize: mean}",
    ),
    ("metrics: [flock_radius]", "metrics: [flock_radius, speed, dispersion]"),
)
SPECS = {
    "small": SMALL,
    "grid": GRID,
    "drawn": DRAWN,
    "covering": COVERING,
    "flying": FLYING,
    "ablated": ABLATED,
}
SPECS["real"] = edited(
    SMALL,
    ("study: small", "study: real"),
    (
        "separation_weight: [0.5, 1]",
        "real:\n    ablate: {slow: {start_speed: 2}, loose: {cohesion_weight: 0.01,"
        " cohesion_range: 40}, far: {separation_range: 30}}\n    leave_out: true",
    ),
)
SPECS["chained"] = (
    SMALL.replace("study: small", "study: chained")
    .replace("n: 12, steps: 9", "n: 12")
    .replace("[0.5, 1]", "{values: [0.5, 1], continue: both, hold: 9}")
)
SPECS["refined"] = SMALL.replace("study: small", "study: refined") + (
    "refine: {metric: speed, at: 3, axes: [separation_weight], until: 0.5, budget: 9}\n"
)
SPECS["drawn_realities"] = SMALL.replace("study: small", "study: drawn_realities") + (
    "realities: {packet_loss: {uniform: [0, 1]}, position_noise: {uniform: [0, 9]},"
    " draws: 30}\n"
)
SPECS["validated"] = SMALL.replace("study: small", "study: validated") + (
    "validate: {dt: [1/2], search: all_pairs, update: both}\n"
)
SPECS["repeated"] = edited(
    SMALL,
    ("study: small", "study: repeated"),
    ("separation_weight: [0.5, 1]", "borders: [torus, bounded]"),
    ("replicates: 3", "replicates: 9"),
    ("series: [speed], every: 2", "metrics: [speed, dispersion]"),
)
SPECS["profiled"] = """\
study: profiled
model: vicsek1995
fixed: {n: 20, steps: 20}
sweep: {noise: [0.5, 3]}
replicates: 3
record: {metrics: [polarization], profiles: [mean_squared_displacement]}
"""
SPECS["calibrated"] = """\
study: calibrated
model: nguyen2024
fixed: {n: 12, steps: 9}
sweep:
  prior: {sample: random, points: 60, separation_weight: {uniform: [0, 2]}}
replicates: 3
calibrate: {to: "small:separation_weight=1", summaries: [speed], population: 50,
  generations: 1}
record: {metrics: [speed]}
"""
SPECS["sized"] = """\
study: sized
model: nguyen2024
fixed: {steps: 20, map: empty}
sizes: {n: [16, 36, 64]}
sweep: {separation_weight: [0.4, 0.6, 0.8, 0.9, 1, 1.1, 1.2, 1.4, 1.6]}
replicates: 3
seed: 1
record:
  derive:
    scaled: (separation_weight - 1) * sqrt(n) / 2 + 0 * polarization
    order: (1 + scaled / 6 + scaled * scaled / 40 + polarization / 99) / sqrt(sqrt(n))
  series: [order]
"""
SPECS["touring"] = """\
study: touring
model: aziel_chen2025
fixed: {n: 4, steps: 4, map: empty, width: 400, height: 300, goal_weight: 0.1,
  goal_x: 100, goal_y: 100, next_goals: [[300, 200]]}
sweep: {separation_weight: [0.1, 0.2]}
replicates: 2
seed: 1
record: {metrics: [speed], trajectories: true}
"""
SPECS |= {"searched": SEARCHED}

_folder = Path(mkdtemp(prefix="plotted-"))
atexit.register(rmtree, _folder)


@cache
def study(name: str) -> StoredStudy:
    """One of SPECS, launched once for all tests of a process, or searched with two
    repetitions.
    """
    if name == "searched":
        asked_by(SEARCHED, _folder, repetitions=2)
        return StoredStudy(name, _folder)
    if name == "calibrated":
        study("small")
    if name == "validated":
        for variant in with_variants(parse_spec(SPECS[name]))[1:]:
            launch(variant, _folder, Serial())
    return launched(SPECS[name], _folder)


def made_up(
    sweep: str,
    function: Callable[[pd.DataFrame], np.ndarray] = ishigami,
    **options: Any,
) -> MadeUp:
    """A study of `sampled.study_of` that has a spec too."""
    study = study_of(sweep, function, **options)
    study.provenance["spec"] = f"sweep: {axes_of(sweep)}"
    return study


def ascending(settings: pd.DataFrame) -> np.ndarray:
    """A metric that is the number of the point."""
    return np.arange(len(settings), dtype=float)


def shown(figure: Figure) -> str:
    """The note under a figure, in one line."""
    return figure.get_supxlabel().replace("\n", " ")


def titles(figure: Figure) -> list[str]:
    """What stands above its panels, each in one line, in their order."""
    return [
        text.replace("\n", " ") for axes in figure.axes if (text := axes.get_title())
    ]


def legend_texts(figure: Figure) -> list[str]:
    """The entries of its legend."""
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]
