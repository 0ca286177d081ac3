"""Metrics against time: mean curves with bands."""

from collections.abc import Sequence

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import curves
from sweep.figures.pieces import note
from sweep.figures.style import LINE_STYLES, STYLE
from sweep.study import StoredStudy


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
        note(figure, f"{_trials(study, by)}, mean with pointwise 95 % interval")
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
