"""Flights side by side in large arrays: each part of each is found again."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from kernels.device.layout import (
    Arrangement,
    Parts,
    Space,
    described,
    form_of,
    lay_out,
    leaves_of,
)
from kernels.device.views import view
from kernels.lanes.texts import function_of


class Common(NamedTuple):
    alike: float
    flag: bool


class Part(NamedTuple):
    table: Any
    marks: Any
    fixed: Any
    own: float
    works: bool
    layer: Any = None


class Whole(NamedTuple):
    part: Part
    common: Common
    pair: tuple[Any, Any]
    count: int
    room: Any
    apart: Any


def tree(rng: np.random.Generator, fixed: Any, length: int) -> Whole:
    """A tree of a flight: two places have one array, one has a length of its own."""
    table = rng.normal(size=(3, 4))
    part = Part(table, rng.random(5) < 0.5, fixed, rng.random(), length > 2)
    loose = rng.integers(0, 9, length).astype(np.uint32)
    pair = table, loose
    return Whole(
        part, Common(0.5, True), pair, 7, np.zeros((2, 3)), np.zeros(4, np.int32)
    )


def parts(one: Whole) -> Parts:
    return Parts((one.part.fixed,), (one.pair[1],), (one.common,))


FIXED, ROOM, APART = 2, 10, 11
"""The places of the leaves `part.fixed`, `room` and `apart`."""


def laid_out(
    count: int, shared: bool = True
) -> tuple[list[Whole], Arrangement, dict[str, Any]]:
    """Flights, their layout, and the large arrays as a device has them."""
    rng = np.random.default_rng(11)
    same = rng.normal(size=6)
    trees = [
        tree(rng, same if shared else rng.normal(size=4 + k), 2 + k % 3)
        for k in range(count)
    ]
    rooms = {
        ROOM: Space((5, 3), np.dtype("f8"), True),
        APART: Space((4,), np.dtype("i2"), False),
    }
    layout = lay_out(trees, parts(trees[0]), shared, rooms)
    large = {
        one: np.zeros(size, layout.types[one]) for one, size in layout.sizes.items()
    }
    for numbers, array in layout.sent(trees).items():
        large[numbers][: array.size] = array.T.reshape(-1)
    for numbers, first, array in layout.apart():
        large[numbers][first : first + array.size] = array.reshape(-1)
    return trees, layout, large


def found(layout: Arrangement, large: dict[str, Any], trial: int) -> Any:
    """What a kernel sees of a flight."""
    given = {f"given{k}": one for k, one in enumerate(layout.common_integers)}
    alike = {f"alike{k}": one for k, one in enumerate(layout.common_floats)}
    classes = {f"Class{k}": one for k, one in enumerate(layout.tree.classes)}
    text = f"def seen(trial, count, fact, number):\n    return {layout.text}"
    seen = function_of(text, {"view": view, **given, **alike, **classes, **large})
    fact, number = layout.facts[:, trial], layout.numbers[:, trial]
    return seen(trial, layout.count, fact, number)


@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("shared", [True, False])
def test_a_flight_has_what_it_had_alone(count: int, shared: bool) -> None:
    trees, layout, large = laid_out(count, shared)
    for trial, alone in enumerate(trees):
        seen = found(layout, large, trial)
        assert type(seen) is Whole
        assert type(seen.part) is Part
        pairs = zip(leaves_of(seen), leaves_of(alone), strict=True)
        for place, (mine, meant) in enumerate(pairs):
            if place not in (ROOM, APART):
                np.testing.assert_array_equal(mine, meant)
        assert seen.part.layer is None
        assert bool(seen.common.flag)
        assert (seen.room.shape, seen.apart.shape) == ((5, 3), (4,))


@pytest.mark.parametrize("shared", [True, False])
def test_the_text_is_that_of_any_flights_of_the_form(shared: bool) -> None:
    """So what is compiled for one serves all batches."""
    texts = {laid_out(count, shared)[1].text for count in (1, 2, 3, 5)}
    assert len(texts) == 1


def test_flights_write_nothing_of_each_other() -> None:
    """Each writes its number into all of its arrays but the fixed one; then each has
    its own there, whatever the others wrote.
    """
    trees, layout, large = laid_out(5)
    for trial in range(5):
        for place, one in enumerate(leaves_of(found(layout, large, trial))):
            if isinstance(one, np.ndarray) and place != FIXED:
                one[...] = trial if one.dtype != bool else trial % 2
    for trial in range(5):
        seen = found(layout, large, trial)
        for one in (seen.part.table, seen.room, seen.apart, seen.pair[1]):
            assert (one == trial).all()
        assert (seen.part.marks == trial % 2).all()
        np.testing.assert_array_equal(seen.part.fixed, trees[0].part.fixed)


def test_neighbouring_flights_have_neighbouring_numbers() -> None:
    """So threads that read the same element read one piece of memory."""
    _, layout, large = laid_out(5)
    tables = [found(layout, large, trial).part.table for trial in range(5)]
    places = [one.__array_interface__["data"][0] for one in tables]
    assert np.diff(places).tolist() == [8] * 4
    assert tables[0].strides == (4 * 5 * 8, 5 * 8)


def test_the_same_array_in_two_places_is_one() -> None:
    _, layout, large = laid_out(3)
    seen = found(layout, large, 1)
    seen.part.table[1, 2] = 99.0
    assert seen.pair[0][1, 2] == 99.0


def test_what_is_brought_back_is_in_the_arrays_of_flights() -> None:
    """Those that nobody may write stay as they are."""
    trees, layout, _ = laid_out(3)
    trees[1].part.table.flags.writeable = False
    before = trees[1].part.table.copy()
    sent = {one: array + 1 for one, array in layout.sent(trees).items() if one != "b1"}
    sent["b1"] = ~layout.sent(trees)["b1"]
    marks = trees[0].part.marks.copy()
    tables = [one.part.table.copy() for one in trees]
    layout.bring(sent, trees)
    np.testing.assert_array_equal(trees[0].part.table, tables[0] + 1)
    np.testing.assert_array_equal(trees[1].part.table, before)
    np.testing.assert_array_equal(trees[0].part.marks, ~marks)


def test_rooms_that_lie_one_by_one_are_one_block() -> None:
    _, layout, large = laid_out(3)
    for trial in range(3):
        found(layout, large, trial).apart[...] = trial
    block = layout.blocks[APART]
    whole = large[block.numbers][block.first :].reshape(block.shape)
    assert whole.tolist() == [[0] * 4, [1] * 4, [2] * 4]


def test_its_bytes_are_those_of_all_arrays() -> None:
    trees, layout, large = laid_out(4)
    arrays = [*large.values(), *layout.sent(trees).values()]
    tables = layout.facts, layout.numbers
    assert layout.bytes == sum(one.nbytes for one in (*arrays, *tables))


def test_the_form_is_what_flights_have_in_common() -> None:
    """Shapes of what is fixed or loose are no part of it, nor are other numbers than
    those in common.
    """
    rng = np.random.default_rng(1)
    one, other = (tree(rng, np.zeros(size), size) for size in (2, 6))
    forms = [form_of(each, parts(each)) for each in (one, other)]
    assert forms[0] == forms[1]
    assert hash(forms[0]) == hash(forms[1])
    for changed in (
        one._replace(part=one.part._replace(layer=np.zeros(2))),
        one._replace(part=one.part._replace(marks=np.zeros(6, np.bool_))),
        one._replace(common=Common(0.6, True)),
        one._replace(pair=(one.part.table.copy(), one.pair[1])),
        one._replace(apart=one.apart.astype(np.int64)),
    ):
        assert form_of(changed, parts(changed)) != forms[0]


@pytest.mark.parametrize(
    ("leaf", "message"),
    [("text", "a flight has 'text'"), (np.zeros(2, np.float32), "type float32")],
)
def test_what_no_device_has_is_refused(leaf: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        described((np.zeros(2), leaf))
