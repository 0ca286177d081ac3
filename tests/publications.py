"""A folder of experiments with one tiny publication, for the tests of claims, pages and
reproductions.
"""

from pathlib import Path

SPEC = """
study: tiny/small
model: nguyen2024
preset: as_run
fixed: {n: 40, steps: 6}
sweep:
  separation_weight: [0.5, 1]
replicates: 8
seed: 5
record: {series: [speed, dispersion], every: 2}
"""

FIGURES = """
import numpy as np
from matplotlib.figure import Figure

from sweep.figures import Drawing


def curves(studies):
    return Figure((1, 1))


def constant(studies):
    return np.zeros(len(studies["small"].trials))


def speeds(studies):
    return studies["small"].trials["speed"].to_numpy()


def two_groups(studies):
    return np.arange(4.0), np.arange(5.0)


def broken(studies):
    raise RuntimeError("no idea")


def shapeless(studies):
    return 3.0


FIGURES = {"curves": Drawing(curves, ("small",), "Speed & dispersion")}
"""

PUBLISHED = """
title: A tiny study
source: "Nobody (2024), <nowhere>"
specs:
  small: {replicates: 3, fixed.steps: 4}
claims:
  - id: start-speed
    where: "Figure 2, frame 0"
    says: "boids start at 0.765 px/step"
    kind: number
    registered: 2024-03-01
    spec: small
    figure: curves
    measure: {mean: speed, frame: 0, for: {separation_weight: 1}}
    expect: {value: 0.765, rounding: 0.0005, trials: 100, margin: 0.2, because: guess}
    looked: before
  - id: hidden
    where: "Section 3 | end"
    says: "it is <b>fast</b>"
    kind: reading
    registered: 2024-03-01
    untestable: "no machine is named"
contradictions:
  - {where: "Section 2", says: "the text says speed 3, the curves start at 0.77"}
"""


def experiments(
    folder: Path, published: str = PUBLISHED, spec: str = SPEC, figures: str = FIGURES
) -> Path:
    """A folder with the publication `tiny`."""
    tiny = folder / "experiments" / "tiny"
    tiny.mkdir(parents=True, exist_ok=True)
    (tiny / "small.yaml").write_text(spec)
    (tiny / "published.yaml").write_text(published)
    (tiny / "figures.py").write_text(figures)
    return tiny.parent
