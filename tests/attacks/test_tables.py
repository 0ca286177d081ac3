"""Tables of points that take more than they say."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import sweep.spec.parquet_sizes as pages
import sweep.spec.point_tables as tables
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.parquet_sizes import PagesError, check_footer, unpacked
from tests.specs import short


def refused(folder: Path, name: str) -> str:
    """What is said of a spec that reads this table."""
    spec = folder / "spec.yaml"
    spec.write_text(short("sweep:", f"  j: {{sample: table, file: {name}}}"))
    with pytest.raises(SpecError) as error:
        load_spec(spec)
    assert str(error.value).startswith("spec.yaml:7: ")
    assert len(str(error.value).splitlines()) == 1
    return str(error.value)


def varint(number: int, length: int = 0) -> bytes:
    """A whole number as Thrift's compact protocol has it, at least so long."""
    rest, signs = 2 * number, []
    while rest > 127 or len(signs) + 1 < length:
        signs.append(rest & 127 | 128)
        rest >>= 7
    return bytes([*signs, rest])


def with_footer_of(path: Path, claimed: int) -> None:
    """Make the footer claim that each column unpacks to so many bytes."""
    content = path.read_bytes()
    length = int.from_bytes(content[-8:-4], "little")
    body, footer = content[: -8 - length], content[-8 - length :]
    about = pq.read_metadata(path)
    for group in map(about.row_group, range(about.num_row_groups)):
        true = varint(group.column(0).total_uncompressed_size)
        footer = footer.replace(true, varint(claimed, len(true)))
    path.write_bytes(body + footer)
    altered = pq.read_metadata(path).row_group(0).column(0)
    assert altered.total_uncompressed_size == claimed


def test_a_footer_that_claims_less_is_not_believed(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tables, "MOST_BYTES", 1_000_000)
    texts = pa.table({"map": [str(row) * 200_000 for row in range(10, 14)]})
    path = tmp_path / "t.parquet"
    pq.write_table(texts, path, compression="zstd", row_group_size=2)
    assert path.stat().st_size < 10_000
    with_footer_of(path, 100)
    assert "unpacks to more than 1,000,000 bytes" in refused(tmp_path, "t.parquet")


@pytest.mark.parametrize("version", ["1.0", "2.0"])
@pytest.mark.parametrize("dictionary", [True, False])
def test_pages_are_counted_without_unpacking(
    tmp_path: Path,
    version: str,
    dictionary: bool,
) -> None:
    rng = np.random.default_rng(1)
    table = pa.table(
        {
            "drag": rng.random(50_000),
            "n": np.arange(50_000) % 7,
            "map": ["empty"] * 50_000,
        }
    )
    path = tmp_path / "t.parquet"
    options = {"data_page_version": version, "use_dictionary": dictionary}
    pq.write_table(table, path, compression="zstd", row_group_size=9000, **options)
    about = pq.read_metadata(path)
    for place, name in enumerate(table.column_names):
        groups = map(about.row_group, range(about.num_row_groups))
        claimed = sum(group.column(place).total_uncompressed_size for group in groups)
        size, values = unpacked(path, about, [name])
        # The footer counts the heads of pages too.
        assert claimed - 200 * about.num_row_groups * 5 < size < claimed
        assert values >= 50_000


def test_texts_by_what_they_share_are_refused(tmp_path: Path) -> None:
    """A text that is the one before and nothing more takes two bytes."""
    path = tmp_path / "t.parquet"
    shared = {"map": "DELTA_BYTE_ARRAY"}
    texts = pa.table({"map": ["x" * 100_000] * 1000})
    pq.write_table(texts, path, use_dictionary=False, column_encoding=shared)
    assert path.stat().st_size < 200_000
    assert "has strings as deltas" in refused(tmp_path, "t.parquet")


HEADS = {
    "no sizes": b"\x15\x00\x00",
    "negative size": b"\x15\x00\x15\x01\x15\x00\x00",
    "size given twice": b"\x15\x00\x15\x00\x15\x00\x05\x04\x00\x00",
    "size of 64 bits": b"\x15\x00\x16\x00\x15\x00\x00",
    "a list": b"\x15\x00\x15\x00\x15\x00\x19\x00\x00",
    "deep": b"\x1c" * 50_000,
    "a long text": b"\x18\xff\xff\xff\xff\x7f",
    "a number without an end": b"\x15" + b"\xff" * 50_000,
}


@pytest.mark.parametrize("head", HEADS)
def test_pages_without_a_true_head_are_refused(tmp_path: Path, head: str) -> None:
    path = tmp_path / "t.parquet"
    pq.write_table(pa.table({"drag": [0.25, 0.5]}), path, compression="none")
    content = path.read_bytes()
    path.write_bytes(content[:4] + HEADS[head] + content[4 + len(HEADS[head]) :])
    about = pq.read_metadata(pa.BufferReader(content))
    with pytest.raises(PagesError, match="has a page"):
        unpacked(path, about, ["drag"])


def test_pages_are_not_counted_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "t.parquet"
    pq.write_table(pa.table({"drag": np.arange(9.0)}), path, row_group_size=1)
    monkeypatch.setattr(pages, "MOST_PAGES", 5)
    assert "has more than 5 pages" in refused(tmp_path, "t.parquet")


def test_a_long_footer_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "t.parquet"
    path.write_bytes(b"PAR1" + bytes(pages.MOST_FOOTER + 9))
    with path.open("ab") as file:
        file.write((pages.MOST_FOOTER + 1).to_bytes(4, "little") + b"PAR1")
    assert "has a footer of more than 10,000,000 bytes" in refused(
        tmp_path, "t.parquet"
    )


@pytest.mark.parametrize("content", [b"", b"PAR1", b"PAR1" * 2, b"x" * 100])
def test_what_is_no_parquet_file_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "t.parquet").write_bytes(content)
    assert '"t.parquet" ' in refused(tmp_path, "t.parquet")
    if content != b"PAR1" * 2:
        with pytest.raises(PagesError, match="not a parquet file"):
            check_footer(tmp_path / "t.parquet")


CSV = {
    "a quote without an end": b'drag\n"0.1\n0.2\n',
    "a text for a number": b"drag\n0.1\nx\n",
    "NUL": b"drag\n0.1\n\0\n",
    "rows of other lengths": b"drag,n\n0.1\n0.2,3\n",
    "no UTF-8": b"drag\n\xff\xfe\n",
    "UTF-16": "drag\n0.1\n".encode("utf-16"),
    "nothing": b"",
    "only a head": b"drag\n",
    "empty cells": b"drag\n\n,\n",
}


@pytest.mark.parametrize("case", CSV)
def test_damaged_csv_files_end_in_a_sentence(tmp_path: Path, case: str) -> None:
    (tmp_path / "t.csv").write_bytes(CSV[case])
    assert "t.csv" in refused(tmp_path, "t.csv")


def test_odd_heads_of_csv_files_end_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_bytes(b"drag,drag\n1,1\n")
    assert '"drag" is read from two columns' in refused(tmp_path, "t.csv")
    (tmp_path / "t.csv").write_bytes(b"dr\0ag\n1\n")
    assert "unknown parameter" in refused(tmp_path, "t.csv")


def test_lines_that_end_in_returns_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tables, "MOST_POINTS", 100)
    (tmp_path / "t.csv").write_bytes(b"drag\n" + b"1\r" * 101)
    assert "has 101 rows; at most 100 are allowed" in refused(tmp_path, "t.csv")


def test_only_the_columns_that_are_asked_for_are_read(tmp_path: Path) -> None:
    """The others would take eight bytes a cell, whatever they take in the file."""
    (tmp_path / "t.csv").write_text("a,b,drag\nx,1,0.5\n,,0.25\n")
    spec = tmp_path / "spec.yaml"
    spec.write_text(short("sweep: {j: {sample: table, file: t.csv, columns: [drag]}}"))
    (axis,) = load_spec(spec).axes
    assert axis.columns["drag"].tolist() == [0.5, 0.25]


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_cells_of_a_table_are_counted_before_they_are_read(
    tmp_path: Path,
    suffix: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sweep.spec.limits.MOST_CELLS", 30)
    table = pa.table({"drag": [0.5] * 20, "n": [2] * 20})
    if suffix == "csv":
        (tmp_path / "t.csv").write_text("drag,n\n" + "0.5,2\n" * 20)
    else:
        pq.write_table(table, tmp_path / "t.parquet")
    assert "make 40 cells; at most 30 are allowed" in refused(tmp_path, f"t.{suffix}")


def test_whole_numbers_of_every_size_are_read_over() -> None:
    """Fields 1 to 3 of 16, 64 and 32 bits, of which the last ones count."""
    head = pages._ThriftReader(b"\x14\x02\x16\x02\x15\x0e\x00").struct()
    assert head == {1: None, 2: None, 3: 7}
