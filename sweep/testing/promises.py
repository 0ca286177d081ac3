"""All promises by name, and what becomes of them for one model."""

import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import SkipTest

from kernels.model import Model
from sweep.errors import UserError
from sweep.testing import offered
from sweep.testing.calls import calls
from sweep.testing.compiled import allocation, interpreter
from sweep.testing.described import presets, settings
from sweep.testing.devices import device
from sweep.testing.driven import motors, robots
from sweep.testing.entrants import Entrant, entrants, has_model
from sweep.testing.grids import grid
from sweep.testing.mishaps import sentence
from sweep.testing.processes import workers
from sweep.testing.reaching import reach
from sweep.testing.restarts import restart
from sweep.testing.subject import Subject, subject
from sweep.testing.symmetries import symmetries


@dataclass(frozen=True)
class Promise:
    """A promise of every model, or of all other entries of a kind: `check` raises
    AssertionError where it is broken, and SkipTest where it does not apply.
    """

    check: Callable[[Any], None]
    text: str


ALL: dict[str, Promise] = {
    "settings": Promise(settings, "every setting has a text, a unit and a range"),
    "presets": Promise(presets, "every preset is complete and allowed"),
    "allocation": Promise(allocation, "a step is compiled, and allocates nothing"),
    "calls": Promise(calls, "a step keeps the flock before it, and tells the grid"),
    "interpreter": Promise(interpreter, "compiled or not, the bits are the same"),
    "grid": Promise(grid, "any grid finds the neighbours that all pairs find"),
    "restart": Promise(restart, "a trial goes on from any step to the same bits"),
    "robots": Promise(robots, "its robots can do what the model declares"),
    "motors": Promise(motors, "with motors each boid is driven once in each step"),
    "workers": Promise(workers, "two workers give the bits of one process"),
    "symmetries": Promise(symmetries, "the declared symmetries hold"),
    "reach": Promise(reach, "nothing beyond the declared reach changes a step"),
    "device": Promise(device, "it can fly on a GPU with the same bits"),
}
"""In the order in which they are best mended."""
PROMISES = tuple(ALL)
"""The names of all promises of models."""
DESCRIBED = Promise(offered.described, "it has a text, and says where it is from")
REPEATS = Promise(
    offered.repeats, "again, and in another process, the bits are the same"
)
OFFERED: dict[str, dict[str, Promise]] = {
    "metrics": {
        "described": DESCRIBED,
        "allocation": Promise(
            offered.allocation, "it is compiled, and allocates nothing"
        ),
        "values": Promise(offered.values, "it writes its values, and nothing else"),
        "interpreter": Promise(
            offered.interpreter, "compiled or not, the bits are the same"
        ),
    },
    "maps": {
        "described": DESCRIBED,
        "bounds": Promise(offered.bounds, "its obstacles lie in the world"),
        "seeds": Promise(offered.seeds, "it says whether it depends on the seed"),
        "repeats": REPEATS,
    },
    "starts": {
        "described": DESCRIBED,
        "bounds": Promise(offered.bounds, "its n boids begin in the world"),
        "repeats": REPEATS,
    },
    "samplers": {
        "described": DESCRIBED,
        "bounds": Promise(offered.bounds, "its points lie in the unit cube"),
        "repeats": REPEATS,
    },
}
"""The promises of what else a file can offer."""
NEEDED = ("settings", "presets", "allocation", "calls")
"""Promises without which the others cannot be tried."""
KEPT, BROKEN, ELSEWHERE = "kept", "broken", "does not apply"


@dataclass(frozen=True)
class Kept:
    """What became of a promise: `status` is KEPT, BROKEN or ELSEWHERE, and `why`
    a sentence where it is not kept. `text` is what is promised, and `of` the entry that
    promises it, as `metric gain`; "" for a model.
    """

    promise: str
    status: str
    why: str
    seconds: float
    text: str
    of: str = ""

    @property
    def words(self) -> str:
        """What is promised, or why that is not kept."""
        return self.why or self.text


def assert_keeps(model: Model | str | Path, promise: str) -> None:
    """Raise AssertionError, with file, line and rule in a sentence, where `model`
    breaks a promise, and `unittest.SkipTest` with the reason where that does not apply.

    `model` is a Model, the path of a file with one, or a name as `subject` reads it;
    `promise` is one of PROMISES, else ValueError is raised.
    """
    if promise not in ALL:
        raise ValueError(f"no promise {promise!r}; allowed: {', '.join(PROMISES)}")
    _check(ALL[promise], subject(model))


def assert_offers(file: str | Path) -> None:
    """Raise AssertionError, with file, line and rule in a sentence, where a metric, a
    map, a start or a sampler of a file breaks a promise.

    Raises CodeError for what is no such entry, and ValueError for a file without any.
    """
    found = entrants(str(file))
    if not found:
        raise ValueError(f"{file}: no METRICS, MAPS, STARTS or SAMPLERS")
    for one in found:
        for promise in OFFERED[one.kind].values():
            with suppress(SkipTest):
                _check(promise, one)


def check_file(reference: str) -> Iterator[Kept]:
    """What becomes of each promise of a model, and of what else its file offers. A file
    without a model is checked for the rest alone.
    """
    others = entrants(reference)
    if not others or has_model(reference):
        yield from check_all(subject(reference))
    for one in others:
        yield from _checked(OFFERED[one.kind], one, one.words)


def check_all(about: Subject) -> Iterator[Kept]:
    """What becomes of each promise of a model, one after the other. Where a needed one
    is broken, the others do not apply.
    """
    return _checked(ALL, about)


def _checked(
    promises: Mapping[str, Promise], about: Subject | Entrant, of: str = ""
) -> Iterator[Kept]:
    lost = ""
    for name, promise in promises.items():
        began, status, why = time.perf_counter(), KEPT, ""
        try:
            if lost:
                raise SkipTest(f'"{lost}" must be kept first')
            _check(promise, about)
        except AssertionError as error:
            status, why = BROKEN, str(error)
            lost = name if name in NEEDED else ""
        except SkipTest as error:
            status, why = ELSEWHERE, str(error)
        seconds = time.perf_counter() - began
        yield Kept(name, status, why, seconds, promise.text, of)


def _check(promise: Promise, about: Subject | Entrant) -> None:
    """An error that the code raises, or kernels with it, breaks the promise, too."""
    try:
        promise.check(about)
    except (AssertionError, SkipTest, UserError):
        raise
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        if Path(last.filename).parent == Path(__file__).parent:  # it is ours
            raise
        raise AssertionError(sentence(error)) from error
