"""Ids of trials as bytes: what is written and read again, and what is found."""

import pyarrow as pa
import pytest
from numpy.random import default_rng
from numpy.testing import assert_array_equal

from sweep.design import trial_ids
from sweep.design.trial_ids import NO_IDS, KnownIds, as_texts, packed

RNG = default_rng(3)
TEXTS = [RNG.bytes(12).hex() for _ in range(200)]
ZEROS = ["0" * 24, "ab" + "0" * 22, "0" * 22 + "ab", "00" * 6 + "ab" * 6]
"""Bytes of zero, which numpy leaves out of texts of its own."""
NO_ID = ["", "no id", "0" * 23, "0" * 25, "A" * 24, "0" * 23 + "\n", "é" * 12]


@pytest.fixture(params=[7, 100_000])
def block(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    monkeypatch.setattr(trial_ids, "BLOCK", request.param)
    return int(request.param)


@pytest.mark.usefixtures("block")
def test_ids_are_written_as_they_were_read() -> None:
    ids = packed([*TEXTS, *ZEROS])
    assert ids.nbytes == 12 * len(ids)
    assert as_texts(ids).to_pylist() == [*TEXTS, *ZEROS]
    assert as_texts(packed([])).to_pylist() == []


@pytest.mark.parametrize("text", NO_ID)
def test_what_is_no_id_is_refused_and_in_a_column_left_out(text: str) -> None:
    with pytest.raises(ValueError, match="24 hexadecimal digits"):
        packed([TEXTS[0], text])
    column = pa.chunked_array([[text, TEXTS[0]], [text, None, TEXTS[1]]], pa.string())
    known = KnownIds.of_column(column)
    assert known.places(packed(TEXTS[:3])).tolist() == [1, 4, -1]
    assert known.places_of_column(column).tolist() == [-1, 1, -1, -1, 4]


@pytest.mark.usefixtures("block")
def test_each_id_is_found_where_it_stood() -> None:
    texts = [*ZEROS, *TEXTS[:100]]
    column = pa.chunked_array([texts[:30], [], texts[30:]], pa.string())
    asked = [*TEXTS, *ZEROS]
    expected = [texts.index(one) if one in texts else -1 for one in asked]
    for known in (KnownIds.of_column(column), KnownIds.of(packed(texts))):
        assert_array_equal(known.places(packed(asked)), expected)
        written = pa.chunked_array([asked[:30], [], asked[30:]], pa.string())
        assert_array_equal(known.places_of_column(written), expected)
        chosen = RNG.random(len(texts)) < 0.5
        left = [one for one, kept in zip(texts, chosen, strict=True) if kept]
        assert sorted(as_texts(known.where(chosen)).to_pylist()) == sorted(left)


def test_among_none_none_is_found() -> None:
    none = KnownIds.of(NO_IDS)
    assert none.places(packed(TEXTS[:2])).tolist() == [-1, -1]
    assert none.places(NO_IDS).tolist() == []
    assert none.places_of_column(as_texts(packed(TEXTS[:2]))).tolist() == [-1, -1]
    assert KnownIds.of(packed(TEXTS)).places(NO_IDS).tolist() == []
