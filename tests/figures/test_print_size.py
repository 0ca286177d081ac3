"""Figures in the size of a journal: width, dots, sizes of text, font."""

import re
from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from sweep.errors import ChoiceError
from sweep.figures import heatmap_figure, parallel_figure, scatter_figure
from sweep.figures.saving import DOTS, MILLIMETRES, POINTS, PrintSize, save
from tests.commands import sweep
from tests.plotted import made_up, study
from tests.sampled import axis

FIGURES: dict[str, Callable[[], Figure]] = {
    "scatter": lambda: scatter_figure(study("grid"), "speed"),
    "heatmap": lambda: heatmap_figure(study("grid"), "speed"),
    "parallel": lambda: parallel_figure(made_up(axis("random", 30)), "speed"),
}
LOGARITHMIC = FIGURES | {
    "logarithmic": lambda: scatter_figure(study("drawn"), "speed", "cohesion_weight")
}
"""With numbers of which matplotlib would raise a part, in smaller letters."""


@pytest.mark.parametrize("width", [89, 183])
@pytest.mark.parametrize("name", LOGARITHMIC)
def test_a_figure_has_the_width_and_the_texts_of_a_journal(
    tmp_path: Path, name: str, width: int
) -> None:
    figure = LOGARITHMIC[name]()
    path = tmp_path / "one"
    files = save(figure, path, formats=("png", "pdf", "svg"), size=PrintSize(width))
    png, pdf, svg = (file.read_bytes() for file in files)
    with Image.open(files[0]) as image:
        assert abs(image.width - width / MILLIMETRES * DOTS) <= 1
        assert image.info["dpi"] == pytest.approx((DOTS, DOTS), abs=0.1)
    (box,) = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ", pdf)
    assert float(box) == pytest.approx(width / MILLIMETRES * 72, abs=0.01)
    least, most = POINTS
    sizes = {
        float(size)
        for size in re.findall(r"font-size: ([\d.]+)px", svg.decode())
        if size  # a point of an SVG of matplotlib is a pixel
    }
    shown = [text for text in figure.findobj(Text) if text.get_text()]
    sizes |= {float(text.get_fontsize()) for text in shown}
    assert sizes
    assert least <= min(sizes)
    assert max(sizes) <= most
    assert png


@pytest.mark.parametrize("name", FIGURES)
def test_texts_are_inside_the_figure(tmp_path: Path, name: str) -> None:
    """Of one column, where the least room is."""
    figure = FIGURES[name]()
    save(figure, tmp_path / "one", formats=("png",), size=PrintSize(89))
    figure.draw_without_rendering()
    width, height = figure.get_size_inches() * figure.dpi
    texts = [text for text in figure.findobj(Text) if text.get_visible()]
    boxes = [text.get_window_extent() for text in texts if text.get_text()]
    assert len(boxes) >= 20
    for box in boxes:
        assert -1 <= box.x0 <= box.x1 <= width + 1
        assert -1 <= box.y0 <= box.y1 <= height + 1
    # In a row of panels no label runs into the next one.
    labels = [axes.xaxis.label.get_window_extent() for axes in figure.axes]
    for one, other in combinations(labels, 2):
        assert not one.overlaps(other)


def test_a_font_is_used_everywhere_or_refused(tmp_path: Path) -> None:
    figure = FIGURES["scatter"]()
    size = PrintSize(89, "DejaVu Serif")
    size.check()
    (svg,) = save(figure, tmp_path / "one", formats=("svg",), size=size)
    fonts = set(re.findall(r"font-family: ([^;]+);", svg.read_text()))
    assert fonts
    assert all("DejaVu Serif" in font for font in fonts)
    with pytest.raises(ChoiceError, match='unknown font "DejaVu Serig"; did you mean'):
        PrintSize(89, "DejaVu Serig").check()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--font", "Arial"], "--font is for a figure with --width"),
        (["--width", "3"], "40"),
        (["--width", "89", "--font", "Ariel Wide"], 'unknown font "Ariel Wide"'),
    ],
)
def test_what_cannot_be_printed_is_refused(options: list[str], message: str) -> None:
    results = study("grid").store.folder.parent
    ended = sweep(results, "plot", "grid", *options, "--results", results)
    assert ended.returncode != 0
    assert message in ended.stderr
