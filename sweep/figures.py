"""House style, and figures from tables. Every figure names its units, its interval and its number of trials.

Colours are those of Okabe and Ito, which people with any form of colour vision can tell apart.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import curves
from sweep.plots import note
from sweep.study import StoredStudy

STYLE = Path(__file__).parent / "house.mplstyle"
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
"""What the figures and claims of a study may be called: their names become those of files and links."""
LINE_STYLES = ("-", "--", "-.", ":", (0, (3, 1, 1, 1, 1, 1)), (0, (6, 2)))


class Drawing(NamedTuple):
    """A figure of a study's figures.py: `draw` gets the stored studies by the names of their specs.

    `specs` are those it needs, and `text` says in one line what it shows.
    """

    draw: Callable[[dict[str, StoredStudy]], Figure]
    specs: tuple[str, ...]
    text: str


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


def save(figure: Figure, path: Path, about: Mapping[str, str] | None = None, watermark: str = "") -> list[Path]:
    """Write `figure` as PNG and PDF, byte-identical for the same input, and return the files.

    `about` goes into their metadata: text chunks of the PNG, subject and keywords of the PDF. The PNG comes last
    and by one rename, so that what it says of itself is true of both.
    """
    about = about or {}
    path.parent.mkdir(parents=True, exist_ok=True)
    if watermark:
        _mark(figure, watermark)
    png, pdf = (path.with_name(path.name + ending) for ending in (".png", ".pdf"))
    unfinished = path.with_name(path.name + ".unfinished")
    sentences = [f"{key}: {value}" for key, value in about.items()]
    subject = {"Subject": sentences[0], "Keywords": "; ".join(sentences[1:])} if about else {}
    figure.savefig(pdf, metadata={"Creator": "boidsweep", "CreationDate": None, **subject})
    figure.savefig(unfinished, format="png", metadata={"Software": "boidsweep", **about})
    unfinished.replace(png)
    return [png, pdf]


def saved_about(path: Path) -> dict[str, str]:
    """What the PNG that `save` wrote says of itself; empty unless both files are there and whole."""
    from PIL import Image, UnidentifiedImageError

    png, pdf = (path.with_name(path.name + ending) for ending in (".png", ".pdf"))
    if not pdf.exists():
        return {}
    try:
        with Image.open(png) as image:
            return {str(key): value for key, value in image.info.items() if isinstance(value, str)}
    except (FileNotFoundError, UnidentifiedImageError):
        return {}


def _mark(figure: Figure, watermark: str) -> None:
    """Write `watermark` large and pale along the diagonal."""
    width, height = figure.get_size_inches()
    slope = math.atan2(height, width)
    size = 72.0 * 0.75 * min(width / math.cos(slope), 2.0 * width) / (0.62 * len(watermark))
    text = figure.text(0.5, 0.5, watermark, ha="center", va="center", rotation=math.degrees(slope))
    text.set(fontsize=size, color="0.4", alpha=0.2, weight="bold", zorder=1000, in_layout=False)
