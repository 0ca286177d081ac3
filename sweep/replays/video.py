"""Writes pictures as a GIF, or through ffmpeg as an MP4."""

import shutil
import subprocess
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
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
    pictures: Pictures, file: BinaryIO, later: Sequence[tuple[int, int, int]] = ()
) -> None:
    """Write pictures (rows, columns, 3) as a GIF that plays again and again. Its
    colours are those of the first picture, and those that come `later`.
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
    next(images).save(file, "gif", save_all=True, append_images=images, **pace)


def write_mp4(pictures: Pictures, file: BinaryIO) -> None:
    """Write pictures (rows, columns, 3) of even size as an MP4. Raises OutputError if
    ffmpeg fails.
    """
    by_path(lambda path: _run_ffmpeg(pictures, path), file)


def _run_ffmpeg(pictures: Pictures, path: Path) -> None:
    first = next(pictures)
    rows, columns, _ = first.shape
    options = (
        f"-y -loglevel error -f rawvideo -pix_fmt rgb24 -s {columns}x{rows}"
        f" -r {FRAMES_A_SECOND} -i - -an -vcodec libx264 -pix_fmt yuv420p"
        " -movflags +faststart -f mp4"
    )
    command = [find_ffmpeg(), *options.split(), f"file:{path}"]
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
