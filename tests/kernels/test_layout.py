"""Flights side by side in large arrays: each part of each is found again."""

from typing import Any, NamedTuple

import numpy as np
import pytest

from kernels.device.layout import (
    Arrangement,
    Space,
    described,
    form_of,
    lay_out,
    leaves_of,
)
from kernels.device.views import view
from kernels.lanes.texts import function_of


class Part(NamedTuple):
    table: Any
    marks: Any
    same: Any
    alike: float
    own: float
    flag: bool
    layer: Any = None


class Whole(NamedTuple):
    part: Part
    pair: tuple[Any, Any]
    count: int
    room: Any
    apart: Any


def tree(rng: np.random.Generator, fixed: Any, length: int) -> Whole:
    """A tree of a flight: two places have one array, one has a length of its own."""
    table = rng.normal(size=(3, 4))
    part = Part(table, rng.random(5) < 0.5, fixed, 0.5, rng.random(), True)
    ragged = rng.integers(0, 9, length).astype(np.uint32)
    return Whole(part, (table, ragged), 7, np.zeros((2, 3)), np.zeros(4, np.int32))


ROOM, APART = 9, 10
"""The places of the leaves `room` and `apart`."""


def laid_out(count: int) -> tuple[list[Whole], Arrangement, dict[str, Any]]:
    """Flights, their layout, and the large arrays as a device has them."""
    rng = np.random.default_rng(11)
    fixed = rng.normal(size=6)
    trees = [tree(rng, fixed, 2 + k % 3) for k in range(count)]
    rooms = {
        ROOM: Space((5, 3), np.dtype("f8"), True),
        APART: Space((4,), np.dtype("i2"), False),
    }
    layout = lay_out(trees, fixed, trees[0].part, rooms)
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
    given = {f"given{k}": one for k, one in enumerate(layout.given)}
    alike = {f"alike{k}": one for k, one in enumerate(layout.alike)}
    classes = {f"Class{k}": one for k, one in enumerate(layout.tree.classes)}
    text = f"def seen(trial, count, fact, number):\n    return {layout.text}"
    seen = function_of(text, {"view": view, **given, **alike, **classes, **large})
    fact, number = layout.facts[:, trial], layout.numbers[:, trial]
    return seen(trial, layout.count, fact, number)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_flight_has_what_it_had_alone(count: int) -> None:
    trees, layout, large = laid_out(count)
    for trial, alone in enumerate(trees):
        seen = found(layout, large, trial)
        assert type(seen) is Whole
        assert type(seen.part) is Part
        pairs = zip(leaves_of(seen), leaves_of(alone), strict=True)
        for place, (mine, meant) in enumerate(pairs):
            if place not in (ROOM, APART):
                np.testing.assert_array_equal(mine, meant)
        assert seen.part.layer is None
        assert bool(seen.part.flag)
        assert (seen.room.shape, seen.apart.shape) == ((5, 3), (4,))


def test_flights_write_nothing_of_each_other() -> None:
    """Each writes its number into all of its arrays but the fixed one; then each has
    its own there, whatever the others wrote.
    """
    trees, layout, large = laid_out(5)
    for trial in range(5):
        for place, one in enumerate(leaves_of(found(layout, large, trial))):
            if isinstance(one, np.ndarray) and place != 2:
                one[...] = trial if one.dtype != bool else trial % 2
    for trial in range(5):
        seen = found(layout, large, trial)
        for one in (seen.part.table, seen.room, seen.apart, seen.pair[1]):
            assert (one == trial).all()
        assert (seen.part.marks == trial % 2).all()
        np.testing.assert_array_equal(seen.part.same, trees[0].part.same)


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


def test_flights_of_another_form_are_refused() -> None:
    rng = np.random.default_rng(1)
    one, other = (tree(rng, np.zeros(6), 2) for _ in range(2))
    other = other._replace(part=other.part._replace(layer=np.zeros(2)))
    assert form_of(one) != form_of(other)
    with pytest.raises(ValueError, match="differ in more than their numbers"):
        lay_out([one, other], (), (), {})


@pytest.mark.parametrize(
    ("leaf", "message"),
    [("text", "a flight has 'text'"), (np.zeros(2, np.float32), "type float32")],
)
def test_what_no_device_has_is_refused(leaf: Any, message: str) -> None:
    with pytest.raises(TypeError, match=message):
        described((np.zeros(2), leaf))
