"""The arrays of many trials, side by side in a few large arrays.

A kernel gets a trial as a tree of named tuples, with arrays and numbers as leaves. The
trees of trials in one batch differ in the leaves alone. Each type of numbers has one
large array for the arrays of T trials. The start and the stride of a leaf define the
elements of the leaf there. A large array has up to three areas.

Side by side: element e of the leaf of trial t is at row e, column t. Threads that read
an element of equal index read one contiguous piece of memory.

Once for all: fixed parts, such as a world, if all trials share the parts.

One by one: fixed parts that differ between trials, and maps. A thread reads adjacent
pixels of a map.

Frames and maps are rooms: the memory starts with arbitrary content, without a transfer.
"""

import hashlib
import math
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]

Type = np.dtype[Any]

NUMBERS = ("f8", "i8", "u8", "i4", "u4", "i2", "u1", "b1")
"""Types of numbers of the arrays of trials, and of fields of records."""
GIVEN = "given"
"""Prefix of the names of integers that are equal in all trials: given0, given1, ...

A GPU reads them without a register.
"""
ALIKE = "alike"
"""Prefix of the names of floats that are equal in all trials."""


class Leaf(NamedTuple):
    """Properties of a leaf that are equal for all trials of a batch.

    `kind` is "array", "float", "int" or "bool". `type` is the type of numbers of an
    array, and `axes` the number of axes. `place` is the index of the first leaf that is
    the identical array.
    """

    kind: str
    type: Type
    axes: int
    place: int

    @property
    def numbers(self) -> str:
        """Name of the large array that contains the leaf."""
        return name_of(self.type)


def name_of(kind: Type) -> str:
    """Return the name of the large array for numbers, or records, of a type."""
    if kind.names is None:
        return str(kind.str[1:])
    return f"record{hashlib.sha256(repr(kind).encode()).hexdigest()[:8]}"


@dataclass(frozen=True)
class Tree:
    """Form of a tree.

    `text` is an expression that builds a tree, with `{}` per item of `leaves` and a
    name per item of `classes`.
    """

    text: str
    leaves: tuple[Leaf, ...]
    classes: tuple[type, ...]


def leaves_of(tree: object) -> Iterator[Any]:
    """Yield the arrays and numbers of a tree, in order."""
    if isinstance(tree, tuple):
        for part in tree:
            yield from leaves_of(part)
    elif tree is not None:
        yield tree


class Parts(NamedTuple):
    """Tuples and arrays of a tree with special rules.

    Arrays of `fixed` may differ in shape between trials, and are not brought back:
    fixed arrays are constant, or follow from the step, such as moving obstacles. Arrays
    of `loose` may differ in shape too. Numbers directly in `common` tuples are equal in
    trials of one form.
    """

    fixed: tuple[object, ...] = ()
    loose: tuple[object, ...] = ()
    common: tuple[object, ...] = ()

    def ids(self) -> "_Ids":
        """Return the identities of the objects."""
        fixed, loose = (
            {id(leaf) for leaf in leaves_of(part)} for part in (self.fixed, self.loose)
        )
        return _Ids(fixed, loose, set(map(id, self.common)))


class _Ids(NamedTuple):
    fixed: set[int]
    loose: set[int]
    common: set[int]


def form_of(tree: object, parts: Parts) -> Hashable:
    """Return a key that is equal for trees that can share a batch."""
    form: Hashable = _form(tree, parts.ids(), {}, False)
    return form


def _form(tree: object, ids: _Ids, known: dict[int, int], common: bool) -> Any:
    if isinstance(tree, tuple):
        inside = id(tree) in ids.common
        return type(tree), tuple([_form(part, ids, known, inside) for part in tree])
    if isinstance(tree, np.ndarray):
        free = id(tree) in ids.fixed or id(tree) in ids.loose
        shape = tree.ndim if free else tree.shape
        return tree.dtype, shape, known.setdefault(id(tree), len(known))
    return (type(tree), tree) if common else type(tree)


def described(tree: object) -> Tree:
    """Return the form of a tree; raise TypeError for a type that no device supports."""
    leaves = list[Leaf]()
    known = dict[int, int]()
    classes = dict[type, str]()
    text = _text(tree, classes)
    for place, value in enumerate(leaves_of(tree)):
        same = known.setdefault(id(value), place) if _is_array(value) else place
        leaves.append(_leaf(value, same))
    return Tree(text, tuple(leaves), tuple(classes))


def _text(tree: object, classes: dict[type, str]) -> str:
    if tree is None:
        return "None"
    if not isinstance(tree, tuple):
        return "{}"
    parts = "".join(f"{_text(part, classes)}, " for part in tree)
    if not hasattr(tree, "_fields"):
        return f"({parts})"
    name = classes.setdefault(type(tree), f"Class{len(classes)}")
    return f"{name}({parts})"


def _is_array(value: object) -> bool:
    return isinstance(value, np.ndarray)


def _leaf(value: Any, same: int) -> Leaf:
    if _is_array(value):
        fields = value.dtype.fields or {"": (value.dtype, 0)}
        if not {name_of(field[0]) for field in fields.values()} <= {*NUMBERS}:
            raise TypeError(f"an array has the type {value.dtype}")
        return Leaf("array", value.dtype, value.ndim, same)
    for kind, types in (("bool", bool), ("int", int), ("float", float)):
        if isinstance(value, types) or (
            isinstance(value, np.generic) and isinstance(value.item(), types)
        ):
            return Leaf(kind, np.dtype(types), 0, same)
    raise TypeError(f"a flight has {value!r}")


class Space(NamedTuple):
    """Array that a device makes, of this `shape` per trial.

    `type` is the type of the numbers. `beside` means that trials are side by side.
    """

    shape: tuple[int, ...]
    type: Type
    beside: bool

    @property
    def numbers(self) -> str:
        """Name of the large array that contains the array."""
        return name_of(self.type)

    @property
    def size(self) -> int:
        """Number of elements per trial."""
        return math.prod(self.shape)


class Block(NamedTuple):
    """Location of the arrays of all trials at one place of the tree.

    The arrays begin at element `first` of the large array `numbers`. Trial follows
    trial, as in an array of `shape` (T, ...). `view` is the expression by which a
    kernel reads the array of a trial.
    """

    numbers: str
    first: int
    shape: tuple[int, ...]
    view: str


@dataclass
class Arrangement:
    """Layout of T trials.

    `types` are the types of numbers of the large arrays by name, and `sizes` the
    numbers of elements. `rows` are the numbers of elements per trial that are side by
    side and are sent. `names_of_rows` are the names of these numbers in a kernel.

    `common_integers` are equal in all trials: integers of the trees, and starts and
    lengths of arrays. `common_floats` are floats that are equal. `facts` (F, T) are
    integers that differ, and `numbers` (S, T) floats that differ.

    `text` is the form of the tree, with an expression of a kernel for each leaf.
    `blocks` are the rooms in the area "one by one", by place. `number_rows` are the
    rows of `numbers`, by place.
    """

    count: int
    tree: Tree
    types: dict[str, Type]
    rows: dict[str, int]
    names_of_rows: dict[str, str]
    sizes: dict[str, int]
    common_integers: tuple[int, ...]
    common_floats: tuple[float, ...]
    facts: NDArray[np.int64]
    numbers: NDArray[np.float64]
    text: str
    blocks: dict[int, Block]
    number_rows: dict[int, int]
    _sent: list[tuple[int, str, int]]
    _apart: list[tuple[str, int, Array]]

    @property
    def bytes(self) -> int:
        """Bytes of memory of a device for all trials.

        The sum includes the large arrays, the arrays that are sent, and the tables.
        """
        sizes = self.sizes.items()
        held = sum(self.types[name].itemsize * size for name, size in sizes)
        sent = sum(self.types[name].itemsize * rows for name, rows in self.rows.items())
        return held + sent * self.count + self.facts.nbytes + self.numbers.nbytes

    def sent(self, trees: Sequence[object]) -> dict[str, Array]:
        """Return the elements that are side by side, by type of numbers.

        The arrays are (T, rows); a device transposes them.
        """
        arrays = self.room_for_sent()
        for flight, tree in enumerate(trees):
            leaves = list(leaves_of(tree))
            for place, numbers, first in self._sent:
                array = leaves[place].reshape(-1)
                arrays[numbers][flight, first : first + array.size] = array
        return arrays

    def room_for_sent(self) -> dict[str, Array]:
        """Return empty arrays (T, rows), by type of numbers."""
        return {
            numbers: np.empty((self.count, rows), self.types[numbers])
            for numbers, rows in self.rows.items()
        }

    def first_of(self, place: int) -> tuple[str, int]:
        """Return the type of numbers of a sent array, and the first row.

        `place` is the place of the leaf in the tree.
        """
        [row] = [(numbers, first) for at, numbers, first in self._sent if at == place]
        return row

    def apart(self) -> Iterator[tuple[str, int, Array]]:
        """Yield the arrays that are not side by side: type, first element, array."""
        return iter(self._apart)

    def bring(self, sent: dict[str, Array], trees: Sequence[object]) -> None:
        """Write arrays that came back into the arrays of trials.

        Parameters
        ----------
        sent : dict of array (T, rows)
            Arrays by type of numbers, as returned by the method `sent`.
        trees : sequence of tuple
            Trees of the trials. Arrays that are not writeable stay unchanged.
        """
        for flight, tree in enumerate(trees):
            leaves = list(leaves_of(tree))
            for place, numbers, first in self._sent:
                array = leaves[place]
                if array.flags.writeable:
                    back = sent[numbers][flight, first : first + array.size]
                    array[...] = back.reshape(array.shape)


def lay_out(
    trees: Sequence[object], parts: Parts, shared: bool, rooms: dict[int, Space]
) -> Arrangement:
    """Return the layout of trials whose trees have one form.

    The text of the layout depends only on the form, `shared` and the rooms.

    Parameters
    ----------
    trees : sequence of tuple
        Trees of T trials.
    parts : Parts
        Parts of the first tree.
    shared : bool
        Whether fixed arrays are identical objects in all trees.
    rooms : dict of Space
        Arrays that the device makes instead of leaves, by place.
    """
    tree = described(trees[0])
    ids = parts.ids()
    builder = _Builder(len(trees), tree, ids, shared)
    columns = list(zip(*map(leaves_of, trees), strict=True))
    is_common = list(_is_common(trees[0], ids, False))
    for place, (leaf, values) in enumerate(zip(tree.leaves, columns, strict=True)):
        if leaf.kind != "array":
            builder.number(leaf.kind, values, is_common[place])
        elif leaf.place < place:
            builder.words.append(builder.words[leaf.place])
        elif place in rooms:
            builder.room(place, rooms[place])
        else:
            builder.array(place, leaf, values)
    return builder.layout()


def _is_common(tree: object, ids: _Ids, common: bool) -> Iterator[bool]:
    """Yield, per leaf, whether trials of one form share the number."""
    if isinstance(tree, tuple):
        for part in tree:
            yield from _is_common(part, ids, id(tree) in ids.common)
    elif tree is not None:
        yield common


class _Builder:
    """Builder of a layout, leaf after leaf."""

    def __init__(self, count: int, tree: Tree, ids: _Ids, shared: bool) -> None:
        self.count = count
        self.tree = tree
        self.ids = ids
        self.shared = shared
        self.words = list[str]()
        self._integers = list[int]()
        self._floats = list[float]()
        self._facts = list[Any]()
        self._numbers = list[Any]()
        self._number_rows = dict[int, int]()
        self._rows = dict[str, int]()
        self._sent = list[tuple[int, str, int]]()
        self._waiting = list[tuple[Space, int]]()
        self._arrays = list[tuple[str, Array, int, int | None]]()
        self._rooms = list[tuple[int, Space, int]]()

    def number(self, kind: str, values: tuple[Any, ...], is_common: bool) -> None:
        """Add a number.

        Parameters
        ----------
        kind : {"float", "int", "bool"}
        values : tuple of float, int or bool
            Value per trial.
        is_common : bool
            Whether all trials have an equal value.
        """
        test = " != 0" if kind == "bool" else ""
        is_float = kind == "float"
        if not is_common:
            if is_float:
                self._number_rows[len(self.words)] = len(self._numbers)
            name, rows = (
                ("number", self._numbers) if is_float else ("fact", self._facts)
            )
            self.words.append(f"{name}[{len(rows)}]{test}")
            rows.append(values)
        elif is_float:
            self.words.append(f"{ALIKE}{len(self._floats)}")
            self._floats.append(float(values[0]))
        else:
            self.words.append(f"{GIVEN}{len(self._integers)}{test}")
            self._integers.append(int(values[0]))

    def array(self, place: int, leaf: Leaf, values: tuple[Array, ...]) -> None:
        """Add an array.

        Parameters
        ----------
        place : int
            Place of the leaf.
        leaf : Leaf
        values : tuple of array
            Array per trial.
        """
        first = values[0]
        numbers = leaf.numbers
        if id(first) in self.ids.fixed and self.shared:
            where = self._view(numbers, "{0}", "1", first.shape)
            self._arrays.append((numbers, first, where, None))
        elif id(first) in self.ids.fixed:
            row = len(self._facts)
            self._facts.append(np.zeros(self.count, np.int64))
            self.words.append(f"view({numbers}, fact[{row}], 1, {self._own(values)})")
            for flight, array in enumerate(values):
                self._arrays.append((numbers, array, row, flight))
        elif id(first) in self.ids.loose:
            start = self._rows.get(numbers, 0)
            begin = f"{GIVEN}{len(self._integers)} * count + trial"
            self._integers.append(start)
            shape = self._own(values)
            self.words.append(f"view({numbers}, {begin}, count, {shape})")
            self._rows[numbers] = start + max(array.size for array in values)
            self._sent.append((place, numbers, start))
        else:
            start = self._beside(numbers, first.shape)
            self._rows[numbers] = start + first.size
            self._sent.append((place, numbers, start))

    def _own(self, values: tuple[Array, ...]) -> str:
        """Return the expression of a shape that differs from trial to trial."""
        row = len(self._facts)
        axes = values[0].ndim
        self._facts += zip(*(array.shape for array in values), strict=True)
        return "({})".format("".join(f"fact[{row + axis}], " for axis in range(axes)))

    def room(self, place: int, room: Space) -> None:
        """Add an array that the device makes.

        Parameters
        ----------
        place : int
            Place of the leaf that the array replaces.
        room : Space
            Shape and type of the array.
        """
        if room.beside:
            self._waiting.append((room, len(self.words)))
            self.words.append("")
        else:
            begin = "{0} + trial * {1}"
            where = self._view(room.numbers, begin, "1", room.shape, unknown=2)
            self._rooms.append((place, room, where))

    def _beside(self, numbers: str, shape: tuple[int, ...]) -> int:
        """Add a view of an array that is side by side; return the first row."""
        start = self._rows.get(numbers, 0)
        where = self._view(numbers, "{0} * count + trial", "count", shape)
        self._integers[where] = start
        return start

    def _view(
        self,
        numbers: str,
        begin: str,
        stride: str,
        shape: tuple[int, ...],
        unknown: int = 1,
    ) -> int:
        """Add the expression of a view that is equal in all trials.

        Returns the index of the first common integer of the view. The expression
        `begin` names the first integers, of which `unknown` are set later.
        """
        first = len(self._integers)
        self._integers += [*[0] * unknown, *shape]
        names = [f"{GIVEN}{k}" for k in range(first, len(self._integers))]
        lengths = "".join(f"{name}, " for name in names[unknown:])
        start = begin.format(*names)
        self.words.append(f"view({numbers}, {start}, {stride}, ({lengths}))")
        return first

    def layout(self) -> Arrangement:
        """Return the layout after the addition of all leaves."""
        rows = dict(self._rows)
        names = dict[str, str]()
        for numbers, size in rows.items():
            names[numbers] = f"{GIVEN}{len(self._integers)}"
            self._integers.append(size)
        for room, word in self._waiting:
            self._beside(room.numbers, room.shape)
            self.words[word] = self.words.pop()
            self._rows[room.numbers] = self._rows.get(room.numbers, 0) + room.size
        sizes = {name: size * self.count for name, size in self._rows.items()}
        apart = list[tuple[str, int, Array]]()
        blocks = dict[int, Block]()
        for numbers, array, where, flight in self._arrays:
            first = sizes.get(numbers, 0)
            sizes[numbers] = first + array.size
            if flight is None:
                self._integers[where] = first
            else:
                self._facts[where][flight] = first
            apart.append((numbers, first, array))
        for place, room, where in self._rooms:
            first = sizes.get(room.numbers, 0)
            sizes[room.numbers] = first + room.size * self.count
            self._integers[where : where + 2] = first, room.size
            blocks[place] = Block(
                room.numbers, first, (self.count, *room.shape), self.words[place]
            )
        types = {
            leaf.numbers: leaf.type for leaf in self.tree.leaves if leaf.kind == "array"
        }
        types |= {room.numbers: room.type for _, room, _ in self._rooms}
        return Arrangement(
            self.count,
            self.tree,
            types={name: types[name] for name in sorted(sizes)},
            rows=rows,
            names_of_rows=names,
            sizes=sizes,
            common_integers=tuple(self._integers),
            common_floats=tuple(self._floats),
            facts=self._table(self._facts, np.int64),
            numbers=self._table(self._numbers, np.float64),
            text=self.tree.text.format(*self.words),
            blocks=blocks,
            number_rows=self._number_rows,
            _sent=self._sent,
            _apart=apart,
        )

    def _table(self, rows: list[Any], numbers: type[Any]) -> Array:
        table = np.zeros((len(rows), self.count), numbers)
        for row, values in enumerate(rows):
            table[row] = values
        return table
