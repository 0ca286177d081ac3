"""Figure 2 of nguyen2024: four metrics against iteration, for five values of one weight.

    python experiments/nguyen2024/figures.py STUDY [STUDY ...]

draws the stored studies, e.g. nguyen2024/separation, into results/<study>/figures.
"""

import sys
from pathlib import Path

from matplotlib.figure import Figure

import sweep
from sweep.figures import metric_curves, save
from sweep.study import StoredStudy


def figure2(study: StoredStudy) -> Figure:
    """One panel of figure 2: the metrics of section 2.3 by the weight that `study` sweeps."""
    return metric_curves(study, study.varied[0])


def main(names: list[str]) -> None:
    """Draw figure 2 for each stored study and print where it is."""
    for name in names:
        for path in save(figure2(sweep.load(name)), Path("results") / name / "figures" / "figure2"):
            print(path)


if __name__ == "__main__":
    main(sys.argv[1:])
