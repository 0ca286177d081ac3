"""The kernel that advances the trial of one thread, and measures the frames.

The text of the kernel depends on the form of the trials. The kernel builds the named
tuples of a trial from views of large arrays. Then the kernel calls the `advance` of the
model and the kernels of the metrics, as a processor does.
"""

import hashlib
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
"""State of a trial.

GOING: the trial continues. LOST: the numbers are not finite. ASTRAY: the model has not
taken the expected number of steps.
"""
STATE, KEPT = range(2)
N_MARKS = 2
"""Marks per trial on a device: the state, and the number of kept frames."""
TAKE, ENTER, LEAVE = range(3)
"""Task of a call: take steps, arrange sent arrays side by side, or undo that."""
INTEGERS = np.dtype(np.int64)
FLOATS = np.dtype(np.float64)
TABLES = {
    "marks": INTEGERS,
    "steps_of": INTEGERS,
    "values": FLOATS,
    "facts": INTEGERS,
    "numbers": FLOATS,
}
"""Arrays of a call in addition to the arrays of the trials, with types of numbers."""
LENGTHS = "count", "n_maps", "n_pixels", "n_frames"
"""Number of trials; of sent maps, 1 or one per trial; of pixels per map; and of frames
per trial for which there is room.
"""
SENT = "sent_"
SENT_MAPS = "sent_maps"


@jit
def copy(source: Any, target: Any) -> None:
    """Copy an array (E,)."""
    for k in range(source.size):
        target[k] = source[k]


@jit
def blank(values: Any) -> None:
    """Set numbers that a metric may leave unchanged to NaN."""
    for k in range(values.size):
        values[k] = math.nan


@jit
def room_for(record: Record, steps: int) -> int:
    """Return the number of steps, at most `steps`, for which frames have room."""
    free = record.frames.step.size - record.progress[FILLED] - 1
    return int(min(steps, free * record.every))


@jit
def steps_done(record: Record) -> int:
    """Return the number of steps that a trial has taken."""
    return int(record.progress[STEP])


@jit
def state_after(going: bool, taken: int, expected: int) -> int:
    """Return the state of a trial after a call of its model.

    Parameters
    ----------
    going : bool
        Result of the model's `advance`: whether all numbers are finite.
    taken : int
        Number of steps that the model took.
    expected : int
        Number of steps that the model had to take.
    """
    if not going:
        return LOST
    return GOING if taken == expected else ASTRAY


@jit
def keep(record: Record, steps_of: Any, count: int) -> int:
    """Note the steps of the filled frames, clear the frames, and return the new count.

    Parameters
    ----------
    record : Record
    steps_of : array (F,) of int
        Steps of all kept frames of the trial.
    count : int
        Number of frames kept before.
    """
    filled = record.progress[FILLED]
    for k in range(filled):
        steps_of[count + k] = record.frames.step[k]
    record.progress[FILLED] = 0
    return int(count + filled)


@dataclass(frozen=True)
class Kernel:
    """Kernel for a device: the `text` of a function for trials of one form.

    `model` advances the trials, `measures` are the kernels of metrics, and `maps` names
    the type of the pixels of maps.

    The arguments of the function are `numbers` and `arrays`. The numbers include
    `n_integers` and `n_floats` numbers of the layout. Each array has one axis.
    """

    model: Model
    measures: tuple[Callable[..., None], ...]
    text: str
    types: dict[str, Type]
    classes: tuple[type, ...]
    maps: str
    n_integers: int
    n_floats: int

    @property
    def numbers(self) -> dict[str, type]:
        """Names and types of the numbers that the function gets, in order."""
        common = (f"{GIVEN}{k}" for k in range(self.n_integers))
        integers = dict.fromkeys(("task", "steps", *LENGTHS, *common), int)
        return integers | {f"{ALIKE}{k}": float for k in range(self.n_floats)}

    @property
    def arrays(self) -> dict[str, Type]:
        """Names and types of the arrays that the function gets, in order."""
        sent = {f"{SENT}{name}": kind for name, kind in self.types.items()}
        return self.types | sent | {SENT_MAPS: self.types[self.maps]} | TABLES

    @property
    def stamp(self) -> str:
        """Hash of the code from which the function is compiled."""
        return stamp_of_made(self.model.advance, *self.measures)

    def function(self, begin: str, **known: Any) -> Callable[..., None]:
        """Return the function that begins with the lines `begin`.

        `begin` names the function and the arguments, and `known` are more globals.
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
        scope |= {f"Class{k}": kind for k, kind in enumerate(self.classes)}
        scope |= {f"measure{k}": measure for k, measure in enumerate(self.measures)}
        function: Callable[..., None] = function_of(
            f"{begin}{self.text}", scope | known
        )
        return function

    def key(self, *compiler: Any) -> str:
        """Return a hash that changes if the kernel must be compiled again.

        `compiler` are the target, the options and the versions of the compiler.
        """
        parts = self.stamp, self.text, self.maps, *compiler
        names = [f"{kind.__module__}.{kind.__qualname__}" for kind in self.classes]
        return hashlib.sha256(repr((parts, names)).encode()).hexdigest()[:48]

    @cached_property
    def of_trial(self) -> Callable[..., None]:
        """Function of the index of a trial, of `numbers` and of `arrays`."""
        return self.of_trial_with()

    def of_trial_with(self, **known: Any) -> Callable[..., None]:
        """Return `of_trial` with more globals."""
        return self.function(f"def fly(trial, {self._arguments}):", **known)

    def of_thread(self, cuda: Any) -> Callable[..., None]:
        """Return the function of a thread of a GPU, of `numbers` and `arrays`.

        The function runs the trial with the index of the thread. `cuda` is the module
        of numba.
        """
        begin = f"""def fly({self._arguments}):
    trial = cuda.grid(1)
    if trial >= count:
        return"""
        return self.function(begin, cuda=cuda)

    @property
    def _arguments(self) -> str:
        return ", ".join([*self.numbers, *self.arrays])


def kernel_of(
    model: Model,
    measures: tuple[Callable[..., None], ...] | None,
    layout: Arrangement,
    maps: int,
) -> Kernel:
    """Return the kernel for trials of a model.

    Parameters
    ----------
    model : Model
    measures : tuple of function or None
        Kernels of metrics. With None, frames stay in memory while there is room.
    layout : Arrangement
        Layout of the trials.
    maps : int
        Place of the maps of visits among the leaves of the tree.
    """
    block = layout.blocks[maps]
    return Kernel(
        model,
        measures=measures or (),
        text=_text(layout, measures, block),
        types=layout.types,
        classes=layout.tree.classes,
        maps=block.numbers,
        n_integers=len(layout.common_integers),
        n_floats=len(layout.common_floats),
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
    """Return calls that copy each type of numbers between the two arrangements."""
    return "; ".join(
        copying.format(
            sent=f"view({SENT}{numbers}, trial * {size}, 1, ({size},))",
            beside=f"view({numbers}, trial, count, ({size},))",
        )
        for numbers, size in layout.names_of_rows.items()
    )
