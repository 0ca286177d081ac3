"""Images as obstacles: the occupied pixels of a file, as few rectangles.

Files may be untrusted. So only plain raster formats of a limited size are decoded.
"""

import io
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from PIL import Image

MOST_SIDE = 4096
MOST_BYTES = 100_000_000
MOST_READS = 1_000_000
"""Largest number of reads of a decoder.

A file of tiny pieces, or with many comments, would occupy the decoder for minutes.
"""
FORMATS = ("PNG", "PPM", "BMP", "JPEG")
"""Allowed formats, for drawings and ROS. PPM includes .pgm and .pbm."""
DECODERS = ("raw", "zip", "jpeg")
"""Decoders of Pillow that are allowed.

All other decoders of the formats take seconds to minutes: plain PPM, PPM with a white
value that is neither 255 nor 65535, and packed BMP.
"""
SEAM = 1e-9
"""Margin of a rectangle on every side, as a fraction of a pixel.

Without a margin, a point on the border of two rectangles would be outside of each.
"""


class ImageError(ValueError):
    """The reason why a file cannot be used as an image."""


class _Counted(io.BufferedReader):
    """A file with a limited number of reads."""

    reads = 0

    def read(self, size: int | None = -1, /) -> bytes:
        self.reads += 1
        if self.reads > MOST_READS:
            raise ImageError("has too many pieces or comments")
        return super().read(size)


def brightness(path: Path) -> NDArray[np.float64]:
    """Return the brightness of every pixel, shape (rows, columns), top row first.

    The brightness is the luminance, from 0 (black) to 255 (white, or transparent).
    Raises ImageError if the file is missing, not an image, too large or too slow to
    read.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        _check_file(path)
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            file = _Counted(io.FileIO(path))
            with file, Image.open(file, formats=FORMATS) as image:
                if max(image.size) > MOST_SIDE:
                    raise ImageError(
                        f"has {image.width} x {image.height} pixels; at most"
                        f" {MOST_SIDE} x {MOST_SIDE}"
                    )
                if slow := {tile[0] for tile in image.tile} - {*DECODERS}:
                    way = ", ".join(sorted(slow))
                    raise ImageError(f"has a slow encoding ({way}): save as PNG")
                return _grey(image)
    except ImageError:
        raise
    except FileNotFoundError:
        raise ImageError(f"does not exist in {path.parent}") from None
    except IsADirectoryError:
        raise ImageError("is a folder") from None
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise ImageError(
            f"is too large; at most {MOST_SIDE} x {MOST_SIDE} pixels"
        ) from None
    except UnidentifiedImageError:
        raise ImageError(f"is not an image; allowed: {', '.join(FORMATS)}") from None
    except Exception as error:
        # Decoders of damaged files raise errors of almost any type.
        raise ImageError(f"cannot be read: {error}") from None


def _check_file(path: Path) -> None:
    # Opening a pipe would block, and a device has no end.
    if path.exists() and not path.is_file() and not path.is_dir():
        raise ImageError("is not a regular file")
    if path.stat().st_size > MOST_BYTES:
        raise ImageError(f"is larger than {MOST_BYTES:,} bytes")


def _grey(image: "Image.Image") -> NDArray[np.float64]:
    if image.mode in ("I;16", "I;16L", "I;16B") or (
        image.mode == "I" and image.format == "PPM"
    ):
        return np.asarray(image, np.float64) / 257.0
    if image.mode in ("I", "F"):
        raise ImageError(
            "has pixels of 32 bits, without a defined white; allowed: up to 16 bits"
        )
    if image.has_transparency_data:
        from PIL import Image

        colours = image.convert("RGBA")
        image = Image.alpha_composite(Image.new("RGBA", colours.size, "white"), colours)
    return np.asarray(image.convert("L"), np.float64)


def rectangles(occupied: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return rectangles (M, 4) that cover exactly the true pixels, each once.

    A row has the first column, the first row, and the column and row after the end of
    the rectangle. Runs of pixels within a row are merged with equal runs in the rows
    below.
    """
    change = np.diff(np.pad(occupied, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, start = np.nonzero(change == 1)
    stop = np.nonzero(change == -1)[1]
    order = np.lexsort((row, stop, start))
    row = row[order]
    start = start[order]
    stop = stop[order]
    new = np.ones(len(row), np.bool_)
    new[1:] = (np.diff(start) != 0) | (np.diff(stop) != 0) | (np.diff(row) != 1)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(row))[: len(first)] - 1
    return np.column_stack([start[first], row[first], stop[first], row[last] + 1])


def obstacles_of(occupied: NDArray[np.bool_], resolution: float) -> NDArray[np.float64]:
    """Return the occupied pixels as obstacles (M, 5), in the form of kernels.worlds.

    A side of a pixel is `resolution` long. Row r of the image is at y = r * resolution.
    So the top left corner of the image is the origin, and images are not mirrored.
    """
    left, top, right, bottom = rectangles(occupied).T.astype(np.float64)
    half_width = (right - left) / 2 + SEAM
    half_height = (bottom - top) / 2 + SEAM
    sizes = (
        np.stack([(left + right) / 2, (top + bottom) / 2, half_width, half_height])
        * resolution
    )
    return np.vstack([sizes, np.zeros(len(left))]).T
