"""Specs, tables, images and stores come from anyone: each attack ends in one sentence,
with nothing executed.
"""

import json
import os
import pickle
import struct
import zlib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sweep.spec.images as images
import sweep.spec.point_tables as tables
from kernels.catalogue import BUILT_IN
from sweep.errors import ChoiceError, SpecError, StoreError
from sweep.own_code.reading import load_spec
from sweep.spec.expressions import ExpressionError, parse
from sweep.spec.settings import settings_of
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from tests.cases import slow_but
from tests.commands import sweep
from tests.specs import short
from tests.studies import SMALL, launched, relaunch


def refused(text: str, folder: Path) -> str:
    """What is said of a spec in `folder`, in one short line."""
    (folder / "spec.yaml").write_text(text)
    with pytest.raises(SpecError) as error:
        load_spec(folder / "spec.yaml")
    assert len(str(error.value)) < 1000
    return str(error.value)


LAUGHS = "a: &a [x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
BOMBS = {
    "aliases": (LAUGHS, "anchors and aliases"),
    "merge": ("a: &a {x: 1}\nb: {<<: *a}\n", "anchors and aliases"),
    "depth": ("[" * 100_000, "nested too deeply"),
    "flow depth": ("{a: " * 900 + "1" + "}" * 900, "nested too deeply"),
    "block depth": (
        "".join(f"{' ' * level}a:\n" for level in range(200)),
        "nested too deeply",
    ),
    "python object": ("a: !!python/object/apply:os.system [touch pwned]\n", "tag"),
    "python name": ("study: !!python/name:os.system\n", "tag"),
    "long integer": (short(f"time_limit: {'9' * 100_000}"), "cannot read"),
    "hexadecimal": (short(f"time_limit: 0x{'f' * 100_000}"), "is too large"),
    "size": ("a" * 1_000_001, "larger than 1,000,000 bytes"),
    "long name": (
        short("record: {metrics: [" + "x" * 500_000 + "]}"),
        'unknown metric "xxx',
    ),
}


LONG_TO_READ = ("depth",)
"""Which takes seconds, and is refused in the same place as the flow of less depth."""


@pytest.mark.parametrize(
    "bomb", slow_but([one for one in BOMBS if one not in LONG_TO_READ], BOMBS)
)
def test_yaml_bombs_are_refused(tmp_path: Path, bomb: str) -> None:
    text, message = BOMBS[bomb]
    assert message in refused(text, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["spec.yaml"]


def test_a_device_without_an_end_is_read_no_further_than_allowed() -> None:
    with pytest.raises(SpecError, match="is larger than"):
        load_spec(Path("/dev/zero"))


ATTACKS = [
    "__import__('os').system('touch pwned')",
    "eval('1')",
    "exec('1')",
    "open('/etc/passwd')",
    "().__class__.__base__.__subclasses__()",
    "(lambda: 1)()",
    "[n for n in (1, 2)]",
    "min(*(1, 2))",
    "max(n, n, key=abs)",
    "(x := 1)",
    "f'{n}'",
    "n.real",
    "n[0]",
    "__builtins__",
    "await n",
    "1j",
    "b'x'",
    "...",
    "None",
    "n @ n",
    "n << 1000000000",
    "9**9**9",
    "1e308 * 10",
    "0x" + "f" * 900,
    "(" * 450 + "1" + ")" * 450,
    "-" * 900 + "1",
    "n" + "+n" * 480,
    "1" * 2000,
    "n\x00",
]


@pytest.mark.parametrize("attack", ATTACKS, ids=range(len(ATTACKS)))
def test_expressions_are_never_evaluated_by_python(
    attack: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ExpressionError):
        parse(attack, settings_of("nguyen2024", BUILT_IN)).evaluate(
            {"n": np.array([2])}, 1
        )
    assert list(tmp_path.iterdir()) == []


NAMES = [
    "../up",
    "a/../../b",
    "/etc/passwd",
    "..",
    ".",
    ".hidden",
    "a//b",
    "a/",
    "a\\b",
    "a b",
    "a\n",
    "~",
    "parts",
    "x/writing",
]


@pytest.mark.parametrize("name", NAMES)
def test_study_names_cannot_leave_the_results(name: str) -> None:
    with pytest.raises(SpecError, match=r'(?s)study ".*" is not allowed'):
        parse_spec(SMALL.replace("study: small", f"study: {json.dumps(name)}"))


@pytest.mark.parametrize("name", ["../up", "a/../../b", "/etc", ".", ""])
def test_stored_studies_cannot_be_sought_outside_of_the_results(
    tmp_path: Path, name: str
) -> None:
    launched(SMALL.replace("study: small", "study: up"), tmp_path)
    (tmp_path / "results").mkdir()
    with pytest.raises(ChoiceError, match="is not allowed"):
        StoredStudy(name, tmp_path / "results")


@pytest.mark.parametrize("what", ["parts", "writing", "spec.yaml", "plan.parquet"])
def test_links_in_a_store_lead_nowhere(tmp_path: Path, what: str) -> None:
    """As in an unpacked archive whose study would make a launch overwrite a file of the
    user's.
    """
    mine = tmp_path / "mine"
    if "." in what:
        mine.write_text("precious")
    else:
        mine.mkdir()
    (tmp_path / "results" / "small").mkdir(parents=True)
    (tmp_path / "results" / "small" / what).symlink_to(mine)
    with pytest.raises(StoreError, match=r"symbolic link|cannot be read"):
        relaunch(SMALL, tmp_path / "results")
    assert mine.read_text() == "precious" if "." in what else list(mine.iterdir()) == []


class Payload:
    """Unpickling it makes a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = str(folder)

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (self.folder,)


def test_no_pickle_is_loaded_from_the_store(tmp_path: Path) -> None:
    """The extension type that older versions of Arrow unpickled, and pandas' own
    metadata with the same payload.
    """
    study, trap = launched(SMALL, tmp_path), tmp_path / "trap"
    payload = pickle.dumps(Payload(trap))
    path = next(study.store.folder.glob("parts/*/trials.parquet"))
    table = pq.read_table(path)
    evil = {
        b"ARROW:extension:name": b"arrow.py_extension_type",
        b"ARROW:extension:metadata": payload,
    }
    index = table.column_names.index("error")
    columns = [table.schema.field(name) for name in table.column_names]
    columns[index] = columns[index].with_metadata(evil)
    pandas = {
        "columns": [
            {
                "name": "speed",
                "pandas_type": "object",
                "numpy_type": "object",
                "metadata": None,
            }
        ]
    }
    about = table.schema.metadata | {
        b"pandas": json.dumps(pandas | {"index_columns": []}).encode(),
        b"pickle": payload,
    }
    pq.write_table(
        pa.Table.from_arrays(table.columns, schema=pa.schema(columns, about)), path
    )
    assert pq.read_schema(path).field("error").metadata == evil
    read = StoredStudy("small", tmp_path)
    assert len(read.trials) == 6
    assert read.statuses()["done"] == 6
    read.store.compact()
    assert not trap.exists()
    pickle.loads(payload)
    assert trap.exists()


def of_table(name: str) -> str:
    return short("sweep:", f"  j: {{sample: table, file: {name}}}")


def test_a_small_parquet_file_with_too_many_rows_is_not_read(tmp_path: Path) -> None:
    """A hundred million equal numbers take a few kilobytes."""
    schema = pa.schema([("drag", pa.float64())])
    with pq.ParquetWriter(tmp_path / "t.parquet", schema) as writer:
        for _ in range(20):
            writer.write_table(pa.table({"drag": pa.repeat(0.5, 1_000_000)}, schema))
    assert (tmp_path / "t.parquet").stat().st_size < 100_000
    assert "has 20,000,000 rows; at most 10,000,000 are allowed" in refused(
        of_table("t.parquet"), tmp_path
    )


def test_long_texts_that_are_repeated_stay_one_text(tmp_path: Path) -> None:
    """They would take two gigabytes one by one, in a file of five kilobytes."""
    text = pa.DictionaryArray.from_arrays(
        pa.repeat(pa.scalar(0, pa.int32()), 20_000), ["x" * 100_000]
    )
    pq.write_table(pa.table({"map": text}), tmp_path / "t.parquet")
    assert (tmp_path / "t.parquet").stat().st_size < 10_000
    assert "has a string of more than 1,000 characters" in refused(
        of_table("t.parquet"), tmp_path
    )


def test_what_unpacks_to_too_much_is_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pq.write_table(
        pa.table({"map": ["x" * 3_000_000]}), tmp_path / "t.parquet", compression="zstd"
    )
    monkeypatch.setattr(tables, "MOST_BYTES", 1_000_000)
    assert (tmp_path / "t.parquet").stat().st_size < 10_000
    assert "unpacks to more than 1,000,000 bytes" in refused(
        of_table("t.parquet"), tmp_path
    )


def test_a_table_of_lists_is_refused_unread(tmp_path: Path) -> None:
    pq.write_table(pa.table({"drag": [[0.5] * 1000]}), tmp_path / "t.parquet")
    assert 'column "drag" has the type list<' in refused(
        of_table("t.parquet"), tmp_path
    )


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_table_of_a_million_columns_is_refused(tmp_path: Path, suffix: str) -> None:
    if suffix == "csv":
        (tmp_path / "t.csv").write_text("drag" + "," * 5_000_000 + "\n1\n")
        assert "has a first line that is too long" in refused(
            of_table("t.csv"), tmp_path
        )
    else:
        pq.write_table(
            pa.table({f"c{index}": [1] for index in range(10_001)}),
            tmp_path / "t.parquet",
        )
        assert "has 10,001 columns; at most 10,000 are allowed" in refused(
            of_table("t.parquet"), tmp_path
        )


def test_a_table_with_too_many_lines_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_bytes(b"drag\n" + b"1\n" * 10_000_001)
    assert "has 10,000,001 rows; at most 10,000,000 are allowed" in refused(
        of_table("t.csv"), tmp_path
    )


def test_a_table_that_is_too_large_is_not_opened(tmp_path: Path) -> None:
    with (tmp_path / "t.csv").open("wb") as file:
        file.truncate(1_000_000_001)
    assert "is larger than 1,000,000,000 bytes" in refused(of_table("t.csv"), tmp_path)


@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("name", ["t.csv", "t.parquet", "t.png", "t.yaml"])
def test_pipes_and_devices_are_not_waited_for(
    tmp_path: Path, name: str, kind: str
) -> None:
    if kind == "pipe":
        os.mkfifo(tmp_path / name)
    else:
        (tmp_path / name).symlink_to("/dev/zero")
    reading = {"t.png": "{image: t.png, resolution: 1}", "t.yaml": "{ros: t.yaml}"}
    text = short(f"maps: {{m: {reading[name]}}}") if name in reading else of_table(name)
    message = refused(text, tmp_path)
    assert "there is no file" in message or "is not a regular file" in message


def png(width: int, height: int, rows: int) -> bytes:
    """A PNG that says it is of some size, with the first of its white rows."""

    def chunk(kind: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content))
            + kind
            + content
            + struct.pack(">I", zlib.crc32(kind + content))
        )

    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    body = zlib.compress((b"\0" + b"\xff" * width) * rows)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", body)
        + chunk(b"IEND", b"")
    )


IMAGE = short("maps: {m: {image: t.png, resolution: 1}}")


@pytest.mark.parametrize(
    ("width", "height"),
    [(4097, 1), (1, 4097), (30_000, 30_000), (2**31 - 1, 2**31 - 1)],
)
def test_an_image_of_too_many_pixels_is_not_unpacked(
    tmp_path: Path, width: int, height: int
) -> None:
    (tmp_path / "t.png").write_bytes(
        png(width, height, 1) if width < 10**6 else png(5, 5, 5)
    )
    content = bytearray((tmp_path / "t.png").read_bytes())
    content[16:24] = struct.pack(">II", width, height)
    content[29:33] = struct.pack(">I", zlib.crc32(content[12:29]))
    (tmp_path / "t.png").write_bytes(content)
    assert "at most 4096 x 4096" in refused(IMAGE, tmp_path)


def test_a_truncated_image_and_one_of_another_kind_are_refused(tmp_path: Path) -> None:
    (tmp_path / "t.png").write_bytes(png(100, 100, 100)[:60])
    assert "cannot be read" in refused(IMAGE, tmp_path)
    (tmp_path / "t.png").write_bytes(
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n(x) print\n"
    )
    assert "is not an image" in refused(IMAGE, tmp_path)
    (tmp_path / "t.png").write_bytes(
        b'<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>'
    )
    assert "is not an image" in refused(IMAGE, tmp_path)


def test_an_image_file_that_is_too_large_is_not_opened(tmp_path: Path) -> None:
    with (tmp_path / "t.png").open("wb") as file:
        file.truncate(images.MOST_BYTES + 1)
    assert "is larger than 100,000,000 bytes" in refused(IMAGE, tmp_path)


def test_a_message_does_not_steer_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(short('fixed: {"\\e[2J\\e]0;mine\\a": 1}'))
    done = sweep(tmp_path, "plan", "spec.yaml")
    assert done.returncode == 2
    assert r"\u001b[2J\u001b]0;mine\u0007" in done.stderr
    assert "\x1b" not in done.stderr
