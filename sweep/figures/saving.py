"""Figures as files that say what they were drawn from."""

import math
from collections.abc import Mapping
from pathlib import Path

from matplotlib.figure import Figure


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
