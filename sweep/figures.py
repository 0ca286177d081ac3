"""House style, and figures from tables. Every figure names its units, its interval and its number of trials.

Colours are those of Okabe and Ito, which people with any form of colour vision can tell apart.
"""

from collections.abc import Sequence
from pathlib import Path

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import curves
from sweep.study import StoredStudy

STYLE = Path(__file__).parent / "house.mplstyle"
LINE_STYLES = ("-", "--", "-.", ":", (0, (3, 1, 1, 1, 1, 1)), (0, (6, 2)))


def metric_curves(study: StoredStudy, by: str, metrics: Sequence[str] = ()) -> Figure:
    """Each series metric against frame, one panel each: mean over trials and pointwise 95 % interval by value of `by`.

    All series metrics where `metrics` is empty.
    """
    names = list(metrics) or [name for name in study.series.columns if name not in ("trial_id", "frame")]
    with style.context(STYLE):
        columns = min(2, len(names))
        rows = -(-len(names) // columns)
        figure = Figure(figsize=(3.6 * columns, 2.5 * rows + 0.7))
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, name in zip(panels, names, strict=False):
            _curve_panel(axes, study, by, name)
        for axes in panels[len(names) :]:
            axes.set_axis_off()
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, title=by.replace("_", " "), loc="outside upper center", ncols=len(labels))
        figure.supxlabel(f"{_trials(study, by)}, mean with pointwise 95 % interval", fontsize=8, color="0.35")
    return figure


def _curve_panel(axes: Axes, study: StoredStudy, by: str, metric: str) -> None:
    table = curves(study.series, study.trials, by, metric)
    for number, (value, curve) in enumerate(table.groupby(by, sort=True)):
        label = f"{value:g}" if isinstance(value, float) else str(value)
        style = LINE_STYLES[number % len(LINE_STYLES)]
        (line,) = axes.plot(curve["frame"], curve["mean"], linestyle=style, label=label)
        axes.fill_between(curve["frame"], curve["low"], curve["high"], color=line.get_color(), alpha=0.2, lw=0)
    unit = study.units.get(metric, "")
    axes.set_xlabel("frame (steps)")
    axes.set_ylabel(metric.replace("_", " ") + (f" ({unit})" if unit else ""))
    axes.set_ylim(bottom=0)
    axes.margins(x=0)


def _trials(study: StoredStudy, by: str) -> str:
    done = study.trials[study.trials["status"] == "done"]
    counts = sorted(set(done.groupby(by).size()))
    number = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    return f"{study.name}: {number} trials a curve"


def save(figure: Figure, path: Path) -> list[Path]:
    """Write `figure` as PNG and PDF, byte-identical for the same input, and return the files."""
    path.parent.mkdir(parents=True, exist_ok=True)
    files = [path.with_suffix(".png"), path.with_suffix(".pdf")]
    figure.savefig(files[0], metadata={"Software": "boidsweep"})
    figure.savefig(files[1], metadata={"Creator": "boidsweep", "CreationDate": None})
    return files
