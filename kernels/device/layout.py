"""The arrays of many flights side by side, in a few large ones.

What a kernel gets of a flight is a tree of named tuples, whose leaves are arrays and
numbers. The trees of flights that fly together differ in their leaves alone. All arrays
of one type of numbers are in one large array of T flights, in which a leaf is found by
where it begins and how far apart its elements are:

    side by side    element e of the leaf of flight t stands at row e, column t: threads
                    that read the same element of their flights read one piece of memory
    once for all    what is fixed, as a world, if all flights have the same
    one by one      what is fixed, if they have not; and maps, of which a thread reads
                    pixels that lie together

Frames and maps are rooms: they begin as they are, and nothing of them is sent before.
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
"""The types of numbers that arrays of flights may have, and fields of their records."""
GIVEN, ALIKE = "given", "alike"
"""The names of whole numbers and of others that are alike in all flights: given0,
given1 and so on. A GPU has them ready, in no register.
"""


class Leaf(NamedTuple):
    """What flights that fly together have in common of a leaf: its `kind`, "array",
    "float", "int" or "bool"; of an array its type of numbers and its `axes`; and the
    `place` of the first leaf that is the same array.
    """

    kind: str
    type: Type
    axes: int
    place: int

    @property
    def numbers(self) -> str:
        """The name of the large array in which it is."""
        return name_of(self.type)


def name_of(kind: Type) -> str:
    """The name of the large array of numbers, or of records, of a type."""
    if kind.names is None:
        return str(kind.str[1:])
    return f"record{hashlib.sha256(repr(kind).encode()).hexdigest()[:8]}"


@dataclass(frozen=True)
class Tree:
    """The form of a tree: the `text` of an expression that makes one, with `{}` for
    each leaf and a name for each of its `classes`, and the `leaves`.
    """

    text: str
    leaves: tuple[Leaf, ...]
    classes: tuple[type, ...]


def leaves_of(tree: object) -> Iterator[Any]:
    """The arrays and numbers of a tree, in order."""
    if isinstance(tree, tuple):
        for part in tree:
            yield from leaves_of(part)
    elif tree is not None:
        yield tree


class Parts(NamedTuple):
    """Parts of a tree, which are tuples or arrays in it. Arrays of `fixed` may have
    other shapes in another flight, and are not brought back: nothing changes them, or
    they follow from the step, as obstacles that move do. Those of `loose` may have
    other shapes, too. Numbers that stand in `common`, and not deeper, are alike in
    flights of one form.
    """

    fixed: tuple[object, ...] = ()
    loose: tuple[object, ...] = ()
    common: tuple[object, ...] = ()

    def ids(self) -> "_Ids":
        fixed, loose = (
            {id(one) for one in leaves_of(part)} for part in (self.fixed, self.loose)
        )
        return _Ids(fixed, loose, set(map(id, self.common)))


class _Ids(NamedTuple):
    fixed: set[int]
    loose: set[int]
    common: set[int]


def form_of(tree: object, parts: Parts) -> Hashable:
    """What trees have in common that can fly together."""
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
    """The form of a tree in words. Raises TypeError for what no device has."""
    leaves, known, classes = list[Leaf](), dict[int, int](), dict[type, str]()
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
        if not {name_of(one[0]) for one in fields.values()} <= {*NUMBERS}:
            raise TypeError(f"an array has the type {value.dtype}")
        return Leaf("array", value.dtype, value.ndim, same)
    for kind, types in (("bool", bool), ("int", int), ("float", float)):
        if isinstance(value, types) or (
            isinstance(value, np.generic) and isinstance(value.item(), types)
        ):
            return Leaf(kind, np.dtype(types), 0, same)
    raise TypeError(f"a flight has {value!r}")


class Space(NamedTuple):
    """An array that a device makes: of this `shape` for each flight, and of numbers of
    this `type`; `beside` says that it lies side by side.
    """

    shape: tuple[int, ...]
    type: Type
    beside: bool

    @property
    def numbers(self) -> str:
        return name_of(self.type)

    @property
    def size(self) -> int:
        return math.prod(self.shape)


class Block(NamedTuple):
    """Where the arrays of all flights stand that a place of the tree has: from `first`
    on in the large array of its `numbers`, in the `shape` (T, ...), one flight after
    the other. `view` is how a kernel reads that of a flight.
    """

    numbers: str
    first: int
    shape: tuple[int, ...]
    view: str


@dataclass
class Arrangement:
    """Where everything of T flights stands.

    `types` are the types of numbers that the large arrays have, by their names, and
    `sizes` the numbers of their elements. `rows` are how many of a flight lie side by
    side and are sent, and `names_of_rows` the given numbers by which a kernel knows
    that. `given` are the whole numbers
    that all flights have in common, and where their arrays begin and how long they are;
    `facts` (F, T) are those in which they differ. `alike` and `numbers` (S, T) are the
    others. `text` is the form of the tree, with what a kernel reads for each leaf.
    `blocks` are the rooms that lie one by one, by their places.
    """

    count: int
    tree: Tree
    types: dict[str, Type]
    rows: dict[str, int]
    names_of_rows: dict[str, str]
    sizes: dict[str, int]
    given: tuple[int, ...]
    alike: tuple[float, ...]
    facts: NDArray[np.int64]
    numbers: NDArray[np.float64]
    text: str
    blocks: dict[int, Block]
    _sent: list[tuple[int, str, int]]
    _apart: list[tuple[str, int, Array]]

    @property
    def bytes(self) -> int:
        """The memory of a device for all flights: the large arrays, what is sent to
        them, and the tables.
        """
        held = sum(self.types[one].itemsize * size for one, size in self.sizes.items())
        sent = sum(self.types[one].itemsize * rows for one, rows in self.rows.items())
        return held + sent * self.count + self.facts.nbytes + self.numbers.nbytes

    def sent(self, trees: Sequence[object]) -> dict[str, Array]:
        """The elements that lie side by side, (T, rows) by their type of numbers: a
        device turns them round.
        """
        made = self.room_for_sent()
        for flight, tree in enumerate(trees):
            leaves = list(leaves_of(tree))
            for place, numbers, first in self._sent:
                array = leaves[place].reshape(-1)
                made[numbers][flight, first : first + array.size] = array
        return made

    def room_for_sent(self) -> dict[str, Array]:
        """Arrays (T, rows), by their type of numbers."""
        return {
            one: np.empty((self.count, rows), self.types[one])
            for one, rows in self.rows.items()
        }

    def apart(self) -> Iterator[tuple[str, int, Array]]:
        """What is in the large arrays besides: numbers, where it begins, and it."""
        return iter(self._apart)

    def bring(self, sent: dict[str, Array], trees: Sequence[object]) -> None:
        """Write what has come back, as it was `sent`, into the arrays of flights."""
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
    """The layout of flights whose trees have one form, with the `parts` of the first.
    `shared` says that their fixed arrays are the same ones. `rooms` are what is in the
    place of some leaves. The text depends on the form, `shared` and the rooms alone.
    """
    tree, ids = described(trees[0]), parts.ids()
    made = _Made(len(trees), tree, ids, shared)
    columns = list(zip(*map(leaves_of, trees), strict=True))
    given = list(_given(trees[0], ids, False))
    for place, (leaf, values) in enumerate(zip(tree.leaves, columns, strict=True)):
        if leaf.kind != "array":
            made.number(leaf.kind, values, given[place])
        elif leaf.place < place:
            made.words.append(made.words[leaf.place])
        elif place in rooms:
            made.room(place, rooms[place])
        else:
            made.array(place, leaf, values)
    return made.layout()


def _given(tree: object, ids: _Ids, common: bool) -> Iterator[bool]:
    """Of each leaf, whether it is a number that flights of one form have in common."""
    if isinstance(tree, tuple):
        for part in tree:
            yield from _given(part, ids, id(tree) in ids.common)
    elif tree is not None:
        yield common


class _Made:
    """A layout that is being made: leaf after leaf."""

    def __init__(self, count: int, tree: Tree, ids: _Ids, shared: bool) -> None:
        self.count, self.tree, self.ids, self.shared = count, tree, ids, shared
        self.words = list[str]()
        self._given = list[int]()
        self._alike = list[float]()
        self._facts = list[Any]()
        self._numbers = list[Any]()
        self._rows = dict[str, int]()
        self._sent = list[tuple[int, str, int]]()
        self._waiting = list[tuple[Space, int]]()
        self._arrays = list[tuple[str, Array, int, int | None]]()
        self._rooms = list[tuple[int, Space, int]]()

    def number(self, kind: str, values: tuple[Any, ...], given: bool) -> None:
        test = " != 0" if kind == "bool" else ""
        is_float = kind == "float"
        if not given:
            name, rows = (
                ("number", self._numbers) if is_float else ("fact", self._facts)
            )
            self.words.append(f"{name}[{len(rows)}]{test}")
            rows.append(values)
        elif is_float:
            self.words.append(f"{ALIKE}{len(self._alike)}")
            self._alike.append(float(values[0]))
        else:
            self.words.append(f"{GIVEN}{len(self._given)}{test}")
            self._given.append(int(values[0]))

    def array(self, place: int, leaf: Leaf, values: tuple[Array, ...]) -> None:
        first, numbers = values[0], leaf.numbers
        if id(first) in self.ids.fixed and self.shared:
            given = self._view(numbers, "{0}", "1", first.shape)
            self._arrays.append((numbers, first, given, None))
        elif id(first) in self.ids.fixed:
            row = len(self._facts)
            self._facts.append(np.zeros(self.count, np.int64))
            self.words.append(f"view({numbers}, fact[{row}], 1, {self._own(values)})")
            for flight, one in enumerate(values):
                self._arrays.append((numbers, one, row, flight))
        elif id(first) in self.ids.loose:
            start = self._rows.get(numbers, 0)
            where = f"{GIVEN}{len(self._given)} * count + trial"
            self._given.append(start)
            shape = self._own(values)
            self.words.append(f"view({numbers}, {where}, count, {shape})")
            self._rows[numbers] = start + max(one.size for one in values)
            self._sent.append((place, numbers, start))
        else:
            start = self._beside(numbers, first.shape)
            self._rows[numbers] = start + first.size
            self._sent.append((place, numbers, start))

    def _own(self, values: tuple[Array, ...]) -> str:
        """The words of the shape that each flight has for itself."""
        row, axes = len(self._facts), values[0].ndim
        self._facts += zip(*(one.shape for one in values), strict=True)
        return "({})".format("".join(f"fact[{row + axis}], " for axis in range(axes)))

    def room(self, place: int, room: Space) -> None:
        if room.beside:
            self._waiting.append((room, len(self.words)))
            self.words.append("")
        else:
            where = "{0} + trial * {1}"
            given = self._view(room.numbers, where, "1", room.shape, 2)
            self._rooms.append((place, room, given))

    def _beside(self, numbers: str, shape: tuple[int, ...]) -> int:
        """Say where an array lies side by side: after those that do so far."""
        start = self._rows.get(numbers, 0)
        given = self._view(numbers, "{0} * count + trial", "count", shape)
        self._given[given] = start
        return start

    def _view(
        self,
        numbers: str,
        where: str,
        stride: str,
        shape: tuple[int, ...],
        unknown: int = 1,
    ) -> int:
        """Add the words of a view that is alike in all flights; return the first of the
        given numbers that say `where` it is, of which so many are not known yet.
        """
        first = len(self._given)
        self._given += [*[0] * unknown, *shape]
        names = [f"{GIVEN}{k}" for k in range(first, len(self._given))]
        lengths = "".join(f"{name}, " for name in names[unknown:])
        start = where.format(*names)
        self.words.append(f"view({numbers}, {start}, {stride}, ({lengths}))")
        return first

    def layout(self) -> Arrangement:
        rows, names = dict(self._rows), dict[str, str]()
        for numbers, size in rows.items():
            names[numbers] = f"{GIVEN}{len(self._given)}"
            self._given.append(size)
        for room, word in self._waiting:
            self._beside(room.numbers, room.shape)
            self.words[word] = self.words.pop()
            self._rows[room.numbers] = self._rows.get(room.numbers, 0) + room.size
        sizes = {one: size * self.count for one, size in self._rows.items()}
        apart, blocks = list[tuple[str, int, Array]](), dict[int, Block]()
        for numbers, array, where, flight in self._arrays:
            first = sizes.get(numbers, 0)
            sizes[numbers] = first + array.size
            if flight is None:
                self._given[where] = first
            else:
                self._facts[where][flight] = first
            apart.append((numbers, first, array))
        for place, room, where in self._rooms:
            first = sizes.get(room.numbers, 0)
            sizes[room.numbers] = first + room.size * self.count
            self._given[where : where + 2] = first, room.size
            blocks[place] = Block(
                room.numbers, first, (self.count, *room.shape), self.words[place]
            )
        types = {
            one.numbers: one.type for one in self.tree.leaves if one.kind == "array"
        }
        types |= {room.numbers: room.type for _, room, _ in self._rooms}
        return Arrangement(
            self.count,
            self.tree,
            {one: types[one] for one in sorted(sizes)},
            rows,
            names,
            sizes,
            tuple(self._given),
            tuple(self._alike),
            self._table(self._facts, np.int64),
            self._table(self._numbers, np.float64),
            self.tree.text.format(*self.words),
            blocks,
            self._sent,
            apart,
        )

    def _table(self, rows: list[Any], numbers: type[Any]) -> Array:
        table = np.zeros((len(rows), self.count), numbers)
        for row, values in enumerate(rows):
            table[row] = values
        return table
