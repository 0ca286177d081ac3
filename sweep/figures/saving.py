"""Figures as files that say what they were drawn from."""

import math
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path

from matplotlib import style
from matplotlib.figure import Figure
from matplotlib.text import Text

from sweep.figures.drawing import as_text
from sweep.figures.style import STYLE
from sweep.store.regular import open_regular
from sweep.tables.outputs import unfinished
from sweep.tables.stored_study import StoredStudy
from sweep.text import harmless

FORMATS = ("png", "svg", "pdf")
BOTH = ("png", "pdf")


def save(
    figure: Figure,
    path: Path,
    about: Mapping[str, str] | None = None,
    watermark: str = "",
    formats: Sequence[str] = BOTH,
    below: Path | None = None,
) -> list[Path]:
    """Write `figure` in each of `formats`, byte-identical for the same input, and
    return the files in that order.

    `about` goes into their metadata: text chunks of a PNG, subject and keywords of a
    PDF, the description of an SVG. Each file appears by one rename; a PNG comes last,
    so that what it says of itself is true of all. `below` is the folder that the user
    has named, by default that of the files: no folder between the two may be a link.
    Raises OutputError where a file cannot be written.
    """
    (below or path.parent).mkdir(parents=True, exist_ok=True)
    if watermark:
        _mark(figure, watermark)
    files = {name: path.with_name(f"{path.name}.{name}") for name in formats}
    for name in sorted(files, key=lambda name: name == "png"):
        # The style has the salt of the ids in an SVG, and the dots an inch.
        with unfinished(files[name], below) as file, style.context(STYLE):
            _show_texts_as_they_are(figure)
            figure.savefig(file, format=name, metadata=_metadata(name, about or {}))
    return list(files.values())


def about_study(study: StoredStudy) -> dict[str, str]:
    """What a file says of the study that it shows: its name, hashes of its spec and
    kernels, the trials done, and by which settings `where` has chosen among them.
    """
    parts = study.parts
    about = {
        "Study": study.name,
        "Spec hash": ", ".join(map(_hash, parts)),
        "kernels_sha": ", ".join(str(one.provenance["kernels_sha"]) for one in parts),
        "Trials": ", ".join(str(one.whole.statuses()["done"]) for one in parts),
    }
    chosen = [f"{name}={value}" for name, value in study.chosen.items()]
    where = ", ".join([*chosen, *study.conditions])
    return about | ({"Where": where} if where else {})


def _hash(study: StoredStudy) -> str:
    return sha256(study.spec.encode(errors="replace")).hexdigest()[:16]


def saved_about(path: Path) -> dict[str, str]:
    """What a PNG that `save` wrote says of itself. Empty unless it and the PDF beside
    it are there and whole.
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


def _show_texts_as_they_are(figure: Figure) -> None:
    """Keep matplotlib from reading mathematics in texts, which may quote a file from
    anyone.

    Numbers at ticks may need mathematics, so texts at ticks are made by `words`.
    """
    for text in figure.findobj(Text):
        if (
            isinstance(text, Text)
            and (shown := as_text(text.get_text())) != text.get_text()
        ):
            text.set_text(shown)


def _metadata(name: str, about: Mapping[str, str]) -> dict[str, str | None]:
    """`about` in the words of a format, without a date."""
    about = {key: harmless(value) for key, value in about.items()}
    if name == "png":
        return {"Software": "boidsweep", **about}
    first, *others = [f"{key}: {value}" for key, value in about.items()] or [""]
    if name == "pdf":
        said = {"Subject": first, "Keywords": "; ".join(others)} if about else {}
        return {"Creator": "boidsweep", "CreationDate": None, **said}
    said = {"Description": "; ".join([first, *others])} if about else {}
    return {"Creator": "boidsweep", "Date": None, **said}


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
