"""Writes pictures as a GIF, or through ffmpeg as an MP4."""

import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from sweep.errors import OutputError
from sweep.tables.outputs import by_path
from sweep.text import installing

FRAMES_A_SECOND = 25
COLOURS = 64
SHADES_APART = 17
"""The distance between two shades of a colour in the palette of a GIF. With it, white
and light grey stay different.
"""

FFMETADATA = ";FFMETADATA1"
"""The first line of a file of metadata, https://ffmpeg.org/ffmpeg-formats.html."""
ESCAPED, ESCAPE = re.compile(r"([=;#\\\n])"), r"\\\1"
TOLD = ("-map_metadata", "1", "-map", "0:v")

Pictures = Iterator[NDArray[np.uint8]]


def find_ffmpeg() -> str:
    """The ffmpeg of the system, or that of imageio-ffmpeg. Raises OutputError if there
    is neither.
    """
    if found := shutil.which("ffmpeg"):
        return found
    if find_spec("imageio_ffmpeg"):
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    raise OutputError(
        f"MP4 needs ffmpeg, which is not installed: {installing('video')} brings one"
        " along; a .gif needs none"
    )


def write_gif(
    pictures: Pictures,
    file: BinaryIO,
    later: Sequence[tuple[int, int, int]] = (),
    comment: str = "",
) -> None:
    """Write pictures (rows, columns, 3) as a GIF that plays again and again. Its
    colours are those of the first picture, and those that come `later`. `comment`
    becomes its comment extension, in UTF-8.
    """
    from PIL import Image

    first = next(pictures)
    shown = first.copy()
    shown[0, : len(later)] = np.array(later, np.uint8).reshape(-1, 3)
    few = Image.fromarray(
        (np.round(shown / SHADES_APART) * SHADES_APART).astype(np.uint8)
    )
    palette = few.quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    images = (
        Image.fromarray(one).quantize(palette=palette, dither=Image.Dither.NONE)
        for one in chain([first], pictures)
    )
    pace = {"duration": 1000 // FRAMES_A_SECOND, "loop": 0}
    said = {"comment": comment.encode()} if comment else {}
    next(images).save(file, "gif", save_all=True, append_images=images, **pace, **said)


def write_mp4(pictures: Pictures, file: BinaryIO, comment: str = "") -> None:
    """Write pictures (rows, columns, 3) of even size as an MP4 with a `comment` in its
    metadata. Raises OutputError if ffmpeg fails.
    """
    if not comment:
        by_path(lambda path: _run_ffmpeg(pictures, path), file)
        return
    with TemporaryDirectory(prefix="boidsweep-") as folder:
        about = Path(folder) / "about"
        about.write_text(_ffmetadata(comment), encoding="utf-8")
        by_path(lambda path: _run_ffmpeg(pictures, path, about), file)


def _ffmetadata(comment: str) -> str:
    """A comment in the format of metadata that ffmpeg reads. An argument of a command
    would be too short for a spec with many shapes.
    """
    return f"{FFMETADATA}\ncomment={ESCAPED.sub(ESCAPE, comment)}\n"


def _run_ffmpeg(pictures: Pictures, path: Path, about: Path | None = None) -> None:
    first = next(pictures)
    rows, columns, _ = first.shape
    taken = (
        f"-y -loglevel error -f rawvideo -pix_fmt rgb24 -s {columns}x{rows}"
        f" -r {FRAMES_A_SECOND} -i -"
    )
    made = "-an -vcodec libx264 -pix_fmt yuv420p -movflags +faststart -f mp4"
    metadata = ["-f", "ffmetadata", "-i", f"file:{about}", *TOLD] if about else []
    options = [*taken.split(), *metadata, *made.split()]
    command = [find_ffmpeg(), *options, f"file:{path}"]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            process.stdin.write(first.tobytes())
            for picture in pictures:
                process.stdin.write(picture.tobytes())
            process.stdin.close()
        except BrokenPipeError:  # ffmpeg has ended; its own error follows
            pass
        error = process.stderr.read().decode(errors="replace").strip()
    if process.returncode != 0:
        said = error.splitlines()[-1] if error else "no reason given"
        raise OutputError(f"ffmpeg cannot write the MP4: {said}")
