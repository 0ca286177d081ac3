"""All promises by name, and what becomes of them for one model."""

import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from unittest import SkipTest

from kernels.model import Model
from sweep.errors import UserError
from sweep.testing.calls import calls
from sweep.testing.compiled import allocation, interpreter
from sweep.testing.described import presets, settings
from sweep.testing.grids import grid
from sweep.testing.mishaps import sentence
from sweep.testing.processes import workers
from sweep.testing.reaching import reach
from sweep.testing.restarts import restart
from sweep.testing.subject import Subject, subject
from sweep.testing.symmetries import symmetries


@dataclass(frozen=True)
class Promise:
    """A promise of every model: `check` raises AssertionError where it is broken, and
    SkipTest where it does not apply.
    """

    check: Callable[[Subject], None]
    text: str


ALL: dict[str, Promise] = {
    "settings": Promise(settings, "every setting has a text, a unit and a range"),
    "presets": Promise(presets, "every preset is complete and allowed"),
    "allocation": Promise(allocation, "a step is compiled, and allocates nothing"),
    "calls": Promise(calls, "a step keeps the flock before it, and tells the grid"),
    "interpreter": Promise(interpreter, "compiled or not, the bits are the same"),
    "grid": Promise(grid, "any grid finds the neighbours that all pairs find"),
    "restart": Promise(restart, "a trial goes on from any step to the same bits"),
    "workers": Promise(workers, "two workers give the bits of one process"),
    "symmetries": Promise(symmetries, "the declared symmetries hold"),
    "reach": Promise(reach, "nothing beyond the declared reach changes a step"),
}
"""In the order in which they are best mended."""
PROMISES = tuple(ALL)
"""The names of all promises."""
NEEDED = ("settings", "presets", "allocation", "calls")
"""Promises without which the others cannot be tried."""
KEPT, BROKEN, ELSEWHERE = "kept", "broken", "does not apply"


@dataclass(frozen=True)
class Kept:
    """What became of a promise: `status` is KEPT, BROKEN or ELSEWHERE, and `why`
    a sentence where it is not kept.
    """

    promise: str
    status: str
    why: str
    seconds: float

    @property
    def words(self) -> str:
        """What is promised, or why that is not kept."""
        return self.why or ALL[self.promise].text


def assert_keeps(model: Model | str | Path, promise: str) -> None:
    """Raise AssertionError, with file, line and rule in a sentence, where `model`
    breaks a promise, and `unittest.SkipTest` with the reason where that does not apply.

    `model` is a Model, the path of a file with one, or a name as `subject` reads it;
    `promise` is one of PROMISES, else ValueError is raised.
    """
    if promise not in ALL:
        raise ValueError(f"no promise {promise!r}; allowed: {', '.join(PROMISES)}")
    _check(subject(model), promise)


def check_all(about: Subject) -> Iterator[Kept]:
    """What becomes of each promise, one after the other. Where a needed one is broken,
    the others do not apply.
    """
    lost = ""
    for promise in PROMISES:
        began, status, why = time.perf_counter(), KEPT, ""
        try:
            if lost:
                raise SkipTest(f'"{lost}" must be kept first')
            _check(about, promise)
        except AssertionError as error:
            status, why = BROKEN, str(error)
            lost = promise if promise in NEEDED else ""
        except SkipTest as error:
            status, why = ELSEWHERE, str(error)
        yield Kept(promise, status, why, time.perf_counter() - began)


def _check(about: Subject, promise: str) -> None:
    """An error that the model raises, or kernels with it, breaks the promise, too."""
    try:
        ALL[promise].check(about)
    except (AssertionError, SkipTest, UserError):
        raise
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        if Path(last.filename).parent == Path(__file__).parent:  # it is ours
            raise
        raise AssertionError(sentence(error)) from error
