"""Files of figures, with the study and the trials in the metadata."""

import math
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple

from matplotlib import font_manager, style
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from sweep.errors import ChoiceError
from sweep.figures.drawing import as_text
from sweep.figures.style import STYLE
from sweep.store import open_regular
from sweep.tables import Results, StoredStudy, stored_parts, unfinished
from sweep.text import harmless, unknown

FORMATS = ("png", "svg", "pdf")
BOTH = ("png", "pdf")
MILLIMETRES = 25.4
"""Millimetres per inch."""
POINTS = (5.0, 7.0)
"""The least and the largest size of text that journals print."""
THINNER = 7.0 / 9.0
"""Sizes of text and lines in print, relative to the style of all figures."""
FLATTEST = 0.75
"""The least relative height of a figure in print: narrow panels need height."""
DOTS = 300
"""Dots per inch that journals require."""


class PrintSize(NamedTuple):
    """The size of a figure in a journal.

    Attributes
    ----------
    width : float
        Width in mm.
    font : str, default ""
        Name of the font; "" for the font of all figures.
    """

    width: float
    font: str = ""

    def check(self) -> None:
        """Raise ChoiceError if the font is not installed."""
        fonts = font_manager.get_font_names()
        if self.font and self.font not in fonts:
            listed = "matplotlib.font_manager.get_font_names() lists the fonts"
            raise ChoiceError(f"{unknown('font', self.font, fonts)}; {listed}")


def save(
    figure: Figure,
    path: Path,
    metadata: Mapping[str, str] | None = None,
    watermark: str = "",
    formats: Sequence[str] = BOTH,
    below: Path | None = None,
    size: PrintSize | None = None,
) -> list[Path]:
    """Write a figure to files, which are byte-identical for identical input.

    Each file appears by one rename. The PNG is written last, so that the metadata of
    the PNG are valid for all files.

    Parameters
    ----------
    figure : Figure
    path : Path
        Path of the files without extensions. Missing folders are made.
    metadata : mapping of str to str, optional
        Text chunks of a PNG, subject and keywords of a PDF, description of an SVG.
    watermark : str, default ""
        Large pale text along the diagonal.
    formats : sequence of {"png", "svg", "pdf"}, default ("png", "pdf")
    below : Path, optional
        Folder that the user has named; by default the folder of the files. No folder
        between the two may be a link.
    size : PrintSize, optional
        Change the figure to this width, with text of 5 to 7 points and 300 dots per
        inch; by default the figure stays as drawn, with 200 dots per inch. The size
        changes `figure` itself, so draw a figure for each size.

    Returns
    -------
    list of Path
        The files, in the order of `formats`.

    Raises
    ------
    OutputError
        If a file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> figure = scatter_figure(sweep.load("my/first"), "speed")
    >>> files = save(figure, Path("speed"), {"Study": "my/first"})
    >>> [file.name for file in files]
    ['speed.png', 'speed.pdf']
    """
    (below or path.parent).mkdir(parents=True, exist_ok=True)
    if size:
        size.check()
        fit(figure, size)
    if watermark:
        _mark(figure, watermark)
    files = {name: path.with_name(f"{path.name}.{name}") for name in formats}
    for name in sorted(files, key=lambda name: name == "png"):
        # The style sets the salt of ids in an SVG, and the dots per inch.
        with unfinished(files[name], below) as file, style.context(STYLE):
            _show_texts_as_they_are(figure)
            figure.savefig(
                file,
                format=name,
                metadata=_in_format(name, metadata or {}),
                dpi=DOTS if size else None,
            )
    return list(files.values())


def about_study(study: Results) -> dict[str, str]:
    """Return the metadata of figures of a study.

    The metadata are the name, hashes of the spec and the kernels, the number of done
    trials, and the conditions that selected trials.
    """
    parts = stored_parts(study)
    metadata = {
        "Study": study.name,
        "Spec hash": ", ".join(map(_hash, parts)),
        "kernels_sha": ", ".join(str(part.provenance["kernels_sha"]) for part in parts),
        "Trials": ", ".join(str(part.whole.statuses()["done"]) for part in parts),
    }
    chosen = [f"{name}={value}" for name, value in study.chosen.items()]
    where = ", ".join([*chosen, *study.conditions])
    return metadata | ({"Where": where} if where else {})


def _hash(study: StoredStudy) -> str:
    return sha256(study.spec.encode(errors="replace")).hexdigest()[:16]


def saved_about(path: Path) -> dict[str, str]:
    """Return the metadata of the PNG that `save` wrote at a path without extension.

    Parameters
    ----------
    path : Path
        Path of the files without extensions.

    Returns
    -------
    dict of str
        Text chunks of the PNG by key; empty if the PNG is missing or damaged, or the
        PDF is missing.

    Examples
    --------
    >>> from pathlib import Path
    >>> figure = scatter_figure(sweep.load("my/first"), "speed")
    >>> files = save(figure, Path("speed-about"), {"Study": "my/first"})
    >>> saved_about(Path("speed-about"))
    {'Software': 'boidsweep', 'Study': 'my/first'}
    >>> saved_about(Path("missing"))
    {}
    """
    from PIL import Image

    png, pdf = (path.with_name(f"{path.name}.{name}") for name in BOTH)
    if not pdf.exists():
        return {}
    try:
        with open_regular(png) as file, Image.open(file, formats=["png"]) as image:
            return {
                str(key): value
                for key, value in image.info.items()
                if isinstance(value, str)
            }
    except Exception:  # decoders of damaged files raise errors of almost any type
        return {}


def fit(figure: Figure, size: PrintSize) -> None:
    """Give a figure the width, the sizes of text and the font of a journal."""
    width, height = figure.get_size_inches()
    scale = size.width / MILLIMETRES / width
    figure.set_size_inches(scale * width, max(scale, FLATTEST) * height)
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        least, most = POINTS
        text.set_fontsize(min(max(THINNER * float(text.get_fontsize()), least), most))
        if size.font:
            text.set_fontfamily(size.font)
    for line in figure.findobj(Line2D):
        assert isinstance(line, Line2D)
        line.set_linewidth(THINNER * line.get_linewidth())
        line.set_markersize(THINNER * line.get_markersize())
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            # Another width has other ticks, which are made when the figure is drawn.
            axis.set_tick_params(which="both", labelsize=POINTS[1])
            if size.font:
                axis.set_tick_params(which="both", labelfontfamily=size.font)
    _wrap_texts(figure)


def _wrap_texts(figure: Figure) -> None:
    """Wrap titles, labels and notes that are wider than their panel or the figure."""
    figure.draw_without_rendering()
    panels = [(axes.title, axes) for axes in figure.axes]
    panels += [(axes.xaxis.label, axes) for axes in figure.axes]
    wide = [(text, axes.get_window_extent().width) for text, axes in panels]
    across = figure.get_window_extent().width
    below = [text for text in figure.findobj(Text) if text.get_figure() is figure]
    wide += [(text, across) for text in below if isinstance(text, Text)]
    for text, room in wide:
        extent = text.get_window_extent().width
        if text.get_text() and text.get_rotation() == 0 and extent > room:
            lines = text.get_text().split("\n")
            letters = int(max(map(len, lines)) * room / extent)
            wrapped = [part for line in lines for part in wrap(line, max(letters, 8))]
            text.set_text("\n".join(wrapped))


def _show_texts_as_they_are(figure: Figure) -> None:
    """Keep matplotlib from reading mathematics in strings, which may quote any file.

    Numbers at ticks may need mathematics, so `words` escapes the names at ticks.
    """
    for text in figure.findobj(Text):
        if (
            isinstance(text, Text)
            and (shown := as_text(text.get_text())) != text.get_text()
        ):
            text.set_text(shown)


def _in_format(name: str, metadata: Mapping[str, str]) -> dict[str, str | None]:
    """Return metadata under the keys of a format, without a date."""
    metadata = {key: harmless(value) for key, value in metadata.items()}
    if name == "png":
        return {"Software": "boidsweep", **metadata}
    first, *rest = [f"{key}: {value}" for key, value in metadata.items()] or [""]
    if name == "pdf":
        texts = {"Subject": first, "Keywords": "; ".join(rest)} if metadata else {}
        return {"Creator": "boidsweep", "CreationDate": None, **texts}
    texts = {"Description": "; ".join([first, *rest])} if metadata else {}
    return {"Creator": "boidsweep", "Date": None, **texts}


def _mark(figure: Figure, watermark: str) -> None:
    """Write `watermark` along the diagonal, large and pale."""
    width, height = figure.get_size_inches()
    slope = math.atan2(height, width)
    size = (
        72.0
        * 0.75
        * min(width / math.cos(slope), 2.0 * width)
        / (0.62 * len(watermark))
    )
    text = figure.text(
        0.5, 0.5, watermark, ha="center", va="center", rotation=math.degrees(slope)
    )
    text.set(
        fontsize=size,
        color="0.4",
        alpha=0.2,
        weight="bold",
        zorder=1000,
        in_layout=False,
    )
