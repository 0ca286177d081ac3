"""Images that take long, hold much, or lead elsewhere: each ends in one sentence."""

import io
import os
import struct
import zlib
from pathlib import Path

import pytest
from PIL import Image

import sweep.spec.images as images
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.images import ImageError, brightness
from sweep.spec.study import parse_spec
from tests.specs import short


def refused(folder: Path, image: str) -> str:
    """What is said of a spec with this image as a map."""
    spec = folder / "spec.yaml"
    spec.write_text(short(f"maps: {{m: {{image: {image}, resolution: 1}}}}"))
    with pytest.raises(SpecError) as error:
        load_spec(spec)
    assert str(error.value).startswith("spec.yaml:6: ")
    assert len(str(error.value).splitlines()) == 1
    return str(error.value)


def chunk(kind: bytes, content: bytes) -> bytes:
    crc = struct.pack(">I", zlib.crc32(kind + content))
    return struct.pack(">I", len(content)) + kind + content + crc


def png(extra: bytes) -> bytes:
    """A PNG of 5 x 5 white pixels with more chunks."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", 5, 5, 8, 0, 0, 0, 0))
    body = chunk(b"IDAT", zlib.compress((b"\0" + b"\xff" * 5) * 5))
    return b"\x89PNG\r\n\x1a\n" + head + extra + body + chunk(b"IEND", b"")


SLOW = {
    "plain bitmap": b"P1\n2 2\n0 1 1 0\n",
    "plain grey": b"P2\n2 2\n255\n0 9 9 0\n",
    "plain colours": b"P3\n1 1\n255\n0 9 9\n",
    "remarks in plain grey": b"P2\n4096 4096\n255\n" + b"#\n" * 1000,
    "another white": b"P5\n2 2\n200\n" + bytes(4),
}


@pytest.mark.parametrize("case", SLOW)
def test_what_pillow_reads_in_python_is_refused_undecoded(
    tmp_path: Path, case: str
) -> None:
    (tmp_path / "t.pgm").write_bytes(SLOW[case])
    assert "has a slow encoding (ppm" in refused(tmp_path, "t.pgm")


def test_a_packed_bmp_is_refused_undecoded(tmp_path: Path) -> None:
    made = io.BytesIO()
    Image.new("P", (8, 8)).save(made, "BMP")
    content = bytearray(made.getvalue())
    content[30:34] = struct.pack("<I", 1)
    (tmp_path / "t.bmp").write_bytes(content)
    assert "has a slow encoding (bmp_rle): save as PNG" in refused(tmp_path, "t.bmp")


PIECES = {
    "chunks": png(chunk(b"abCd", b"") * 2000),
    "texts": png(chunk(b"tEXt", b"k\0v") * 2000),
    "remarks in a head": b"P5\n" + b"#\n" * 2000 + b"2 2\n255\n" + bytes(4),
}


@pytest.mark.parametrize("case", PIECES)
def test_reads_are_counted(
    tmp_path: Path,
    case: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    path = tmp_path / "t.png"
    path.write_bytes(PIECES[case])
    assert brightness(path).min() in (0, 255)
    monkeypatch.setattr(images, "MOST_READS", 1000)
    assert "has too many pieces" in refused(tmp_path, "t.png")


def test_an_image_of_the_largest_size_is_read_in_few_pieces(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(images, "MOST_READS", 1000)
    Image.new("L", (images.MOST_SIDE, images.MOST_SIDE), 255).save(tmp_path / "t.png")
    assert brightness(tmp_path / "t.png").shape == (images.MOST_SIDE, images.MOST_SIDE)


@pytest.mark.parametrize("kind", [b"zTXt", b"iCCP"])
def test_packed_remarks_are_not_unpacked_whole(tmp_path: Path, kind: bytes) -> None:
    packed = zlib.compress(bytes(100_000_000), 9)
    (tmp_path / "t.png").write_bytes(png(chunk(kind, b"k\0\0" + packed)))
    assert "cannot be read: Decompressed data too large" in refused(tmp_path, "t.png")


OTHERS = ["GIF", "TIFF", "WEBP", "ICO", "PDF", "EPS", "ICNS", "JPEG2000", "TGA", "PCX"]


@pytest.mark.parametrize("form", OTHERS)
def test_other_formats_are_not_tried(tmp_path: Path, form: str) -> None:
    Image.new("RGB", (32, 32)).save(tmp_path / "t.png", format=form)
    assert "is not an image; allowed: PNG, PPM, BMP, JPEG" in refused(tmp_path, "t.png")


@pytest.mark.parametrize("form", images.FORMATS)
@pytest.mark.parametrize("mode", ["1", "L", "RGB"])
def test_the_formats_that_are_allowed_are_read(
    tmp_path: Path, form: str, mode: str
) -> None:
    Image.new(mode, (32, 16)).save(tmp_path / "t.png", format=form)
    assert brightness(tmp_path / "t.png").tolist() == [[0.0] * 32] * 16


@pytest.mark.parametrize("form", images.FORMATS)
def test_images_that_are_cut_off_end_in_a_sentence(tmp_path: Path, form: str) -> None:
    made = io.BytesIO()
    Image.effect_noise((40, 40), 50).save(made, form)
    path = tmp_path / "t.png"
    for length in range(0, len(made.getvalue()) - 12, 97):
        path.write_bytes(made.getvalue()[:length])
        with pytest.raises(ImageError):
            brightness(path)


def test_files_elsewhere_are_read_only_as_images(tmp_path: Path) -> None:
    """A spec may name any file that its user may read, as an editor would open it."""
    secret = tmp_path / "secret.txt"
    secret.write_text("root:x:0:0: do not tell\n")
    (tmp_path / "in").mkdir()
    for name in ("../secret.txt", str(secret)):
        message = refused(tmp_path / "in", name)
        assert "is not an image" in message
        assert "do not tell" not in message
    (tmp_path / "in" / "m.yaml").write_text("image: ../secret.txt\nresolution: 1\n")
    (tmp_path / "in" / "s.yaml").write_text(short("maps: {m: {ros: m.yaml}}"))
    with pytest.raises(SpecError, match="is not an image"):
        load_spec(tmp_path / "in" / "s.yaml")
    (tmp_path / "in" / "s.yaml").write_text(short("maps: {m: {ros: ../secret.txt}}"))
    with pytest.raises(SpecError) as error:
        load_spec(tmp_path / "in" / "s.yaml")
    assert "do not tell" not in str(error.value)


def test_the_image_of_a_ros_map_is_an_ordinary_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "t.pgm")
    (tmp_path / "m.yaml").write_text("image: t.pgm\nresolution: 1\n")
    (tmp_path / "spec.yaml").write_text(short("maps: {m: {ros: m.yaml}}"))
    with pytest.raises(SpecError, match=r"^m.yaml:1: .* is not a regular file"):
        load_spec(tmp_path / "spec.yaml")


def test_maps_are_counted_before_any_is_read() -> None:
    maps = ", ".join(
        f"m{index}: {{image: absent.png, resolution: 1}}" for index in range(101)
    )
    with pytest.raises(SpecError, match="has 101 maps; at most 100 are allowed"):
        parse_spec(short(f"maps: {{{maps}}}"))
