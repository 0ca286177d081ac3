"""Animations from figures: GIF, or MP4 through ffmpeg."""

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
from sweep.tables import by_path
from sweep.text import installing

FRAMES_A_SECOND = 25
COLOURS = 64
SHADES_APART = 17
"""The distance between two shades of a colour in the palette of a GIF.

With this distance, white and light grey stay different.
"""

FFMETADATA = ";FFMETADATA1"
"""The first line of a file of metadata, https://ffmpeg.org/ffmpeg-formats.html."""
ESCAPED = re.compile(r"([=;#\\\n])")
ESCAPE = r"\\\1"
FROM_SECOND_INPUT = ("-map_metadata", "1", "-map", "0:v")

Pictures = Iterator[NDArray[np.uint8]]


def find_ffmpeg() -> str:
    """Return the path of ffmpeg: of the system, or else of imageio-ffmpeg.

    Raises
    ------
    OutputError
        ffmpeg is not installed.
    """
    if of_system := shutil.which("ffmpeg"):
        return of_system
    if find_spec("imageio_ffmpeg"):
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    raise OutputError(
        f"MP4 needs ffmpeg, which is not installed: {installing('video')} installs"
        " ffmpeg; a .gif does not need ffmpeg"
    )


def write_gif(
    pictures: Pictures,
    file: BinaryIO,
    later: Sequence[tuple[int, int, int]] = (),
    comment: str = "",
) -> None:
    """Write figures as a GIF that plays in a loop.

    Parameters
    ----------
    pictures : iterator of ndarray of uint8, shape (rows, columns, 3)
        The figures. The palette has the colours of the first one.
    file : binary file
        The new file.
    later : sequence of (int, int, int), optional
        Colours of later figures, red, green and blue, which are added to the palette.
    comment : str, default ""
        The text of the comment extension, written in UTF-8.
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
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in chain([first], pictures)
    )
    pace = {"duration": 1000 // FRAMES_A_SECOND, "loop": 0}
    extra = {"comment": comment.encode()} if comment else {}
    next(images).save(file, "gif", save_all=True, append_images=images, **pace, **extra)


def write_mp4(pictures: Pictures, file: BinaryIO, comment: str = "") -> None:
    """Write figures as an MP4.

    Parameters
    ----------
    pictures : iterator of ndarray of uint8, shape (rows, columns, 3)
        The figures; the numbers of rows and columns are even.
    file : binary file
        The new file.
    comment : str, default ""
        The comment in the metadata.

    Raises
    ------
    OutputError
        ffmpeg fails.
    """
    if not comment:
        by_path(lambda path: _run_ffmpeg(pictures, path), file)
        return
    with TemporaryDirectory(prefix="boidsweep-") as folder:
        metadata = Path(folder) / "metadata"
        metadata.write_text(_ffmetadata(comment), encoding="utf-8")
        by_path(lambda path: _run_ffmpeg(pictures, path, metadata), file)


def _ffmetadata(comment: str) -> str:
    """Return a comment in the metadata format of ffmpeg.

    An argument of a command would be too short for a spec with many shapes.
    """
    return f"{FFMETADATA}\ncomment={ESCAPED.sub(ESCAPE, comment)}\n"


def _run_ffmpeg(pictures: Pictures, path: Path, metadata: Path | None = None) -> None:
    first = next(pictures)
    rows, columns, _ = first.shape
    source = (
        f"-y -loglevel error -f rawvideo -pix_fmt rgb24 -s {columns}x{rows}"
        f" -r {FRAMES_A_SECOND} -i -"
    )
    target = "-an -vcodec libx264 -pix_fmt yuv420p -movflags +faststart -f mp4"
    comment = (
        ["-f", "ffmetadata", "-i", f"file:{metadata}", *FROM_SECOND_INPUT]
        if metadata
        else []
    )
    options = [*source.split(), *comment, *target.split()]
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
        except BrokenPipeError:  # ffmpeg has ended; the error of ffmpeg follows
            pass
        error = process.stderr.read().decode(errors="replace").strip()
    if process.returncode != 0:
        reason = error.splitlines()[-1] if error else "no reason given"
        raise OutputError(f"ffmpeg cannot write the MP4: {reason}")
