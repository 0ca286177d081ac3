"""Trials that a page computes itself, as WebAssembly.

The page has the module of each kernel, and the memory of a device before the first step
of each trial. So the page has no frames, and the reader's browser checks the results.
Initial conditions and streams of random numbers come from NumPy. Therefore the page has
the memory after these calls, and not the seed alone.
"""

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.util import find_spec
from itertools import chain
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from sweep.design import DEMANDS, Job
from sweep.errors import ChoiceError
from sweep.spec import RecordSpec, parse, settings_of
from sweep.text import installing
from sweep.trial import (
    DeviceStart,
    changes_only,
    device_start,
    not_on_device,
    refusal_of_wasm,
    wasm_module,
)
from sweep.web import packed

PACKAGES = "wasmtime", "ziglang"
FACTOR = 2.0
"""Largest factor by which a reader may change a parameter that does not vary."""
TABLES = "marks", "steps_of", "values", "numbers"
"""Arrays of a kernel that the script of a page reads or writes by name."""
Ranges = Mapping[str, tuple[float, float]]
NO_RANGES: Ranges = MappingProxyType({})


class ComputedStart(NamedTuple):
    """A trial before the first step, for a page.

    Attributes
    ----------
    kernel : str
        Key of the kernel.
    tables : dict
        Index of each of TABLES among the arrays of the memory.
    rooms : list of (int, int)
        Number of elements, and bytes of an element, of each array of the memory.
    pieces : list of (int, int, str)
        Array, first element, and packed content.
    wholes, reals : bytes
        Integers and floats of the first call, of 64 bits each.
    bodies : (int, list of int)
        Array of the flock, and the first elements of x, y, vx and vy there.
    first : list of float or None
        Metrics before the first step; None for a number that is not finite.
    faces : bool
        Whether a resting boid keeps the heading.
    changes : list of dict
        Parameters that a reader may change; see `_changes`.
    """

    kernel: str
    tables: dict[str, int]
    rooms: list[tuple[int, int]]
    pieces: list[tuple[int, int, str]]
    wholes: bytes
    reals: bytes
    bodies: tuple[int, list[int]]
    first: list[float | None]
    faces: bool
    changes: list[dict[str, Any]]


def check_computed(jobs: Sequence[Job], metric: str, study: str) -> None:
    """Raise ChoiceError if a page cannot compute trials.

    Parameters
    ----------
    jobs : sequence of Job
        The trials. The message has one trial per reason.
    metric : str
        Metric of the figure.
    study : str
        Name of the study.
    """
    missing = [name for name in PACKAGES if find_spec(name) is None]
    if missing:
        raise ChoiceError(
            f"a page that computes trials needs {' and '.join(missing)}:"
            f" {installing('wasm')}",
            study,
        )
    reasons: dict[str, Job] = {}
    for job in jobs:
        if why := _refusal(job, metric):
            reasons.setdefault(why, job)
    if reasons:
        listed = [f"{why} (point {job.point})" for why, job in reasons.items()]
        raise ChoiceError(
            "\n  ".join(
                [
                    "a page cannot compute the trials; a figure without --compute can"
                    " show such trials:",
                    *listed,
                ]
            ),
            study,
        )


def _refusal(job: Job, metric: str) -> str:
    computed = computed_metrics(job)
    if metric not in computed:
        derived = metric not in job.record.metrics
        why = (
            "derived from further metrics" if derived else "measured on processors only"
        )
        return f"{metric} is {why}; allowed: {', '.join(computed) or 'no metric'}"
    return refusal_of_wasm(_measured_only(job))


def computed_start(job: Job, ranges: Ranges = NO_RANGES) -> ComputedStart:
    """Return a trial before the first step.

    Parameters
    ----------
    job : Job
    ranges : mapping, optional
        Lowest and highest value of the parameters that vary in the study.
    """
    begun = device_start(_measured_only(job))
    image = begun.image
    names = list(image.kernel.arrays)
    n_floats = image.kernel.n_floats
    last_integer = len(image.numbers) - n_floats
    return ComputedStart(
        kernel=image.kernel.key(),
        tables={name: names.index(name) for name in TABLES},
        rooms=[*image.rooms],
        pieces=[
            (place, first, packed(content)) for place, first, content in image.pieces
        ],
        wholes=np.array(image.numbers[:last_integer], np.int64).tobytes(),
        reals=np.array(image.numbers[last_integer:], np.float64).tobytes(),
        bodies=(names.index(begun.numbers), list(begun.bodies)),
        first=[
            value if np.isfinite(value) else None
            for value in begun.values[:, -1].tolist()
        ],
        faces=job.catalogue.models[job.model].faces_heading,
        changes=list(_changes(job, begun, ranges)),
    )


def _changes(job: Job, begun: DeviceStart, ranges: Ranges) -> Iterator[dict[str, Any]]:
    """Yield the parameters that a page can change, with the ends of their values.

    A parameter can change if no requirement of the model or a metric names it: a value
    could violate the requirement, alone or with further changes. Also, the memory
    before the first step must differ in nothing but this number, for both ends. A range
    of perception, for example, also decides the size of the cells of a search. `row` is
    the element of the array "numbers".
    """
    described = settings_of(job.model, job.catalogue)
    bare = _measured_only(job)
    demanded = _demanded(job)
    for name, row in begun.rows.items():
        if name in demanded:
            continue
        setting = described[name]
        value = float(job.settings[name])
        ends = ranges.get(name, (value / FACTOR, value * FACTOR))
        low = max(min(*ends, value), setting.low)
        high = min(max(*ends, value), setting.high)
        is_open = setting.exclusive and low <= setting.low
        if low < high and not is_open and np.isfinite([low, high]).all():
            ends = low, high
            if all(changes_only(bare, begun, name, end) for end in ends):
                yield {
                    "name": name,
                    "text": setting.text,
                    "unit": setting.unit,
                    "value": value,
                    "low": low,
                    "high": high,
                    "row": row,
                }


def _demanded(job: Job) -> frozenset[str]:
    """Return the parameters that requirements of a trial name."""
    described = settings_of(job.model, job.catalogue)
    model = job.catalogue.models[job.model]
    measured = [job.catalogue.metrics[name].demands for name in job.record.metrics]
    demands = chain(DEMANDS, model.demands, model.potential_demands, *measured)
    return frozenset[str]().union(
        *(parse(demand.condition, described).names for demand in demands)
    )


class Computation:
    """The part of a page that computes trials: modules, and contents of memory.

    Each content is in the page once, as trials have most contents in common.
    """

    def __init__(self) -> None:
        self._modules: dict[tuple[str, tuple[str, ...]], dict[str, Any]] = {}
        self._contents: dict[str, int] = {}

    def begun(
        self, job: Job, start: ComputedStart, last: Sequence[float]
    ) -> dict[str, Any]:
        """Return the start of a trial, ready for JSON; its module is compiled.

        Parameters
        ----------
        job : Job
        start : ComputedStart
            Result of `computed_start`.
        last : sequence of float
            Stored values of the metrics `computed_metrics` at the last frame.
        """
        metrics = computed_metrics(job)
        key = start.kernel, metrics
        if key not in self._modules:
            module = wasm_module(_measured_only(job))
            self._modules[key] = {
                "code": packed(module.code),
                "pages": module.pages,
                "tables": start.tables,
                "metrics": metrics,
            }
        return {
            "module": list(self._modules).index(key),
            "rooms": start.rooms,
            "pieces": [
                (room, first, self._place(content))
                for room, first, content in start.pieces
            ],
            "wholes": _text(start.wholes),
            "reals": _text(start.reals),
            "bodies": start.bodies,
            "first": start.first,
            "last": _text(np.array(last, np.float64).tobytes()),
            "faces": start.faces,
            "changes": start.changes,
            "n": int(job.settings["n"]),
            "steps": int(job.settings["steps"]),
        }

    def shared(self) -> Mapping[str, Any]:
        """Return the modules and contents, ready for JSON."""
        return {
            "modules": list(self._modules.values()),
            "contents": list(self._contents),
        }

    def _place(self, content: str) -> int:
        return self._contents.setdefault(content, len(self._contents))


def _text(content: bytes) -> str:
    return base64.b64encode(content).decode()


def _measured_only(job: Job) -> Job:
    """Return a trial that records nothing but the metrics that a device measures."""
    record = RecordSpec(computed_metrics(job), every=job.record.every)
    return replace(job, record=record)


def computed_metrics(job: Job) -> tuple[str, ...]:
    """Return the metrics of a trial that a page can compute."""
    lacking = not_on_device(job)
    return tuple(name for name in job.record.metrics if name not in lacking)
