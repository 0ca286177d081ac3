"""The kernel that advances the flight of one thread, and measures its frames.

Its text is made of the form of the flights: it makes the named tuples of a flight from
views of large arrays, and calls the `advance` of the model and the kernels of the
metrics, which are those of processors.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from textwrap import dedent, indent
from typing import Any

import numpy as np

from kernels.caching import stamp_of_made
from kernels.device.layout import ALIKE, GIVEN, Arrangement, Block, Type
from kernels.device.views import view
from kernels.jit import jit
from kernels.lanes.texts import function_of
from kernels.model import Model
from kernels.recording import FILLED, STEP, Record

GOING, LOST, ASTRAY = range(3)
"""The state of a flight: it goes on; its numbers are not finite; its model has not
taken the steps that it was to take.
"""
STATE, KEPT = range(2)
N_MARKS = 2
"""What a device keeps of a flight besides: its state, and how many frames it has kept
and measured.
"""
TAKE, ENTER, LEAVE = range(3)
"""What a call is for: to take steps, to turn what was sent side by side, and back."""
WHOLE, OTHER = np.dtype(np.int64), np.dtype(np.float64)
TABLES = {
    "marks": WHOLE,
    "steps_of": WHOLE,
    "values": OTHER,
    "facts": WHOLE,
    "numbers": OTHER,
}
"""The arrays of a call besides those of the flights, and their types of numbers."""
LENGTHS = "count", "n_maps", "n_pixels", "n_frames"
"""Of flights; of the maps that were sent, 1 or as many as flights; of the pixels of a
map; and of the frames that there is room for.
"""
SENT, SENT_MAPS = "sent_", "sent_maps"


@jit
def copy(source: Any, target: Any) -> None:
    """Copy an array (E,)."""
    for k in range(source.size):
        target[k] = source[k]


@jit
def blank(values: Any) -> None:
    """Set numbers that a metric may leave as they are."""
    for k in range(values.size):
        values[k] = math.nan


@jit
def room_for(record: Record, steps: int) -> int:
    """How many of so many steps the frames have room for."""
    free = record.frames.step.size - record.progress[FILLED] - 1
    return int(min(steps, free * record.every))


@jit
def steps_done(record: Record) -> int:
    """The steps that a flight has taken."""
    return int(record.progress[STEP])


@jit
def state_after(going: bool, taken: int, wanted: int) -> int:
    """The state of a flight whose model says that it is `going`."""
    if not going:
        return LOST
    return GOING if taken == wanted else ASTRAY


@jit
def keep(record: Record, steps_of: Any, kept: int) -> int:
    """Note the steps of the frames that are filled, and forget these frames; return how
    many are kept now.
    """
    filled = record.progress[FILLED]
    for k in range(filled):
        steps_of[kept + k] = record.frames.step[k]
    record.progress[FILLED] = 0
    return int(kept + filled)


@dataclass(frozen=True)
class Kernel:
    """What a device is to run: the `text` of a function, of flights of a `model` that
    are of one form, and the kernels that measure them. The pixels of their `maps` are
    numbers of that type.

    The function gets `numbers`, among them so many `given` and `alike` ones of the
    layout, and `arrays`, each of them whole, that is of one axis.
    """

    model: Model
    measures: tuple[Callable[..., None], ...]
    text: str
    types: dict[str, Type]
    classes: tuple[type, ...]
    maps: str
    given: int
    alike: int

    @property
    def numbers(self) -> dict[str, type]:
        """The numbers that are given to the function, in order, and their types."""
        given = (f"{GIVEN}{k}" for k in range(self.given))
        whole = dict.fromkeys(("task", "steps", *LENGTHS, *given), int)
        return whole | {f"{ALIKE}{k}": float for k in range(self.alike)}

    @property
    def arrays(self) -> dict[str, Type]:
        """The arrays that are given to the function, in order, and their types of
        numbers.
        """
        sent = {f"{SENT}{name}": kind for name, kind in self.types.items()}
        return self.types | sent | {SENT_MAPS: self.types[self.maps]} | TABLES

    @property
    def stamp(self) -> str:
        """What decides whether the function must be compiled again."""
        return stamp_of_made(self.model.advance, *self.measures)

    def function(self, begin: str, **known: Any) -> Callable[..., None]:
        """The function that begins with these lines, which name it and its arguments
        and know also what is `known`.
        """
        scope: dict[str, Any] = {
            "__name__": self.model.advance.__module__,
            "view": view,
            "copy": copy,
            "blank": blank,
            "room_for": room_for,
            "steps_done": steps_done,
            "state_after": state_after,
            "keep": keep,
            "advance": self.model.advance,
        }
        scope |= {f"Class{k}": one for k, one in enumerate(self.classes)}
        scope |= {f"measure{k}": one for k, one in enumerate(self.measures)}
        made: Callable[..., None] = function_of(f"{begin}{self.text}", scope | known)
        return made

    @cached_property
    def of_trial(self) -> Callable[..., None]:
        """The function of a trial: of its number, `numbers` and `arrays`."""
        return self.function(f"def fly(trial, {self._given}):")

    def of_thread(self, cuda: Any) -> Callable[..., None]:
        """The function of a thread of a GPU, by numba's module `cuda`: of `numbers` and
        `arrays`. It takes the trial that has the number of the thread.
        """
        begin = f"""def fly({self._given}):
    trial = cuda.grid(1)
    if trial >= count:
        return"""
        return self.function(begin, cuda=cuda)

    @property
    def _given(self) -> str:
        return ", ".join([*self.numbers, *self.arrays])


def kernel_of(
    model: Model,
    measures: tuple[Callable[..., None], ...] | None,
    layout: Arrangement,
    maps: int,
) -> Kernel:
    """The kernel of flights of a model, laid out so, whose maps are in the place `maps`
    of the tree. With None for `measures` frames stay, as far as there is room.
    """
    text, block = _text(layout, measures, layout.blocks[maps]), layout.blocks[maps]
    types, classes = layout.types, layout.tree.classes
    given, alike = len(layout.given), len(layout.alike)
    return Kernel(
        model, measures or (), text, types, classes, block.numbers, given, alike
    )


def _text(
    layout: Arrangement, measures: tuple[Callable[..., None], ...] | None, maps: Block
) -> str:
    end = "kept = filled"
    if measures is not None:
        place = f"(trial * {len(measures)} + {{}}) * n_frames + kept, 1, (filled,)"
        calls = [
            f"kept_by{k} = view(values, {place.format(k)}); blank(kept_by{k});"
            f" measure{k}(record.frames, filled, ground, observation, kept_by{k})"
            for k in range(len(measures))
        ]
        end = "; ".join([*calls, "kept = keep(record, steps_of_flight, kept)"])
    text = f"""
        mark = view(marks, trial, count, ({N_MARKS},))
        fact = view(facts, trial, count, ({len(layout.facts)},))
        number = view(numbers, trial, count, ({len(layout.numbers)},))
        if task == {ENTER}:
            first = trial * n_pixels if n_maps > 1 else 0
            copy(
                view({SENT_MAPS}, first, 1, (n_pixels,)),
                {maps.view},
            )
            {_turned(layout, "copy({sent}, {beside})")}
        elif task == {LEAVE}:
            {_turned(layout, "copy({beside}, {sent})")}
        elif mark[{STATE}] == {GOING}:
            flock, world, params, work, record, ground, observation, rng = {layout.text}
            steps_of_flight = view(steps_of, trial * n_frames, 1, (n_frames,))
            left, state, kept = steps, {GOING}, mark[{KEPT}]
            record.progress[{FILLED}] = 0
            while left > 0 and state == {GOING}:
                wanted = room_for(record, left)
                if wanted <= 0:
                    break
                before = steps_done(record)
                going = advance(flock, world, params, work, record, rng, wanted)
                taken = steps_done(record) - before
                state = state_after(going, taken, wanted)
                left -= taken
                filled = record.progress[{FILLED}]
                {end}
            mark[{STATE}], mark[{KEPT}] = state, kept
    """
    return indent(dedent(text), " " * 4)


def _turned(layout: Arrangement, copying: str) -> str:
    """What copies each type of numbers of a flight between where it was sent and where
    it lies side by side.
    """
    return "; ".join(
        copying.format(
            sent=f"view({SENT}{one}, trial * {size}, 1, ({size},))",
            beside=f"view({one}, trial, count, ({size},))",
        )
        for one, size in layout.names_of_rows.items()
    )
