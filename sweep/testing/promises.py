"""All promises by name, and the outcomes for one model."""

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
    """A promise of every model, or of all entries of another kind.

    `check` raises AssertionError if the promise is broken, and SkipTest if it does not
    apply. `text` is the promise in words.
    """

    check: Callable[[Any], None]
    text: str


ALL: dict[str, Promise] = {
    "settings": Promise(
        settings, "every parameter has a description, a unit and a range"
    ),
    "presets": Promise(presets, "every preset is complete and allowed"),
    "allocation": Promise(allocation, "a step is compiled, and allocates nothing"),
    "calls": Promise(calls, "a step keeps previous velocities and updates the grid"),
    "interpreter": Promise(interpreter, "identical results, compiled or interpreted"),
    "grid": Promise(grid, "any grid finds the neighbours of a search of all pairs"),
    "restart": Promise(restart, "a trial that resumes from any step is identical"),
    "robots": Promise(robots, "declared abilities agree with the source code"),
    "motors": Promise(motors, "actuation drives each boid once in each step"),
    "workers": Promise(workers, "identical results with one process or two workers"),
    "symmetries": Promise(symmetries, "the declared symmetries are true"),
    "reach": Promise(reach, "nothing beyond the declared reach changes a step"),
    "device": Promise(device, "a GPU can run the model with identical results"),
}
"""Promises of models by name, in the best order to fix them."""
PROMISES = tuple(ALL)
"""Names of all promises of models."""
DESCRIBED = Promise(offered.described, "a description and a source are given")
REPEATS = Promise(
    offered.repeats, "identical values in a second draw and in another process"
)
OFFERED: dict[str, dict[str, Promise]] = {
    "metrics": {
        "described": DESCRIBED,
        "allocation": Promise(
            offered.allocation, "compiled, without allocation of memory"
        ),
        "values": Promise(offered.values, "one value per frame, and nothing else"),
        "interpreter": Promise(
            offered.interpreter, "identical results, compiled or interpreted"
        ),
    },
    "maps": {
        "described": DESCRIBED,
        "bounds": Promise(offered.bounds, "all obstacles are in the world"),
        "seeds": Promise(offered.seeds, "a dependence on the seed is declared"),
        "repeats": REPEATS,
    },
    "starts": {
        "described": DESCRIBED,
        "bounds": Promise(offered.bounds, "all n boids begin in the world"),
        "repeats": REPEATS,
    },
    "samplers": {
        "described": DESCRIBED,
        "bounds": Promise(offered.bounds, "all points are in the unit cube"),
        "repeats": REPEATS,
    },
}
"""Promises of metrics, maps, initial conditions and samplers, by kind and name."""
NEEDED = ("settings", "presets", "allocation", "calls")
"""Promises that must be kept before further promises can be checked."""
KEPT = "kept"
BROKEN = "broken"
ELSEWHERE = "does not apply"


@dataclass(frozen=True)
class Kept:
    """The outcome of a promise.

    `status` is KEPT, BROKEN or ELSEWHERE, and `why` a sentence unless the promise is
    kept. `text` is the promise in words. `of` is the entry that makes the promise, such
    as `metric gain`; "" for a model.
    """

    promise: str
    status: str
    why: str
    seconds: float
    text: str
    of: str = ""

    @property
    def words(self) -> str:
        """The promise, or the reason why it is not kept."""
        return self.why or self.text


def assert_keeps(model: Model | str | Path, promise: str) -> None:
    """Check a promise of a model.

    Parameters
    ----------
    model : Model, str or Path
        A Model, the path of a file with a Model such as ``"vortex.py"`` or
        ``"vortex.py:NAME"``, an object of a module such as ``"package.module:NAME"``,
        or the name of a registered model.
    promise : str
        One of PROMISES.

    Raises
    ------
    AssertionError
        If the model breaks the promise. The sentence names file, line and rule.
    unittest.SkipTest
        If the promise does not apply, with the reason.
    ValueError
        If `promise` is not one of PROMISES.
    ChoiceError
        If there is no such model.
    CodeError
        If the file has no model, or cannot be loaded.

    Examples
    --------
    >>> assert_keeps("vortex.py", "settings")  # nothing is raised: the promise is kept
    >>> assert_keeps("vortex.py", "colours")
    Traceback (most recent call last):
    ...
    ValueError: no promise 'colours'; allowed: settings, presets, allocation, ...
    """
    if promise not in ALL:
        raise ValueError(f"no promise {promise!r}; allowed: {', '.join(PROMISES)}")
    _check(ALL[promise], subject(model))


def assert_offers(file: str | Path) -> None:
    """Check the promises of the metrics, maps, starts and samplers of a file.

    Parameters
    ----------
    file : str or Path
        Path of the file.

    Raises
    ------
    AssertionError
        If an entry breaks a promise. The sentence names file, line and rule.
    CodeError
        If an entry of the file is not valid.
    ValueError
        If the file has no entries.

    Examples
    --------
    >>> assert_offers("mine.py")  # a file with Metric(..., source="")
    Traceback (most recent call last):
    ...
    AssertionError: mine.py, line ...: metric mine has no source
    """
    checked = entrants(str(file))
    if not checked:
        raise ValueError(f"{file}: no METRICS, MAPS, STARTS or SAMPLERS")
    for entrant in checked:
        for promise in OFFERED[entrant.kind].values():
            with suppress(SkipTest):
                _check(promise, entrant)


def check_file(reference: str) -> Iterator[Kept]:
    """Yield the outcome of each promise of a model and of the rest of the file.

    For a file without a model, only the further entries are checked. A promise is
    checked when the iterator yields the outcome.

    Parameters
    ----------
    reference : str
        The path of a file such as ``"vortex.py"`` or ``"vortex.py:NAME"``, an object of
        a module such as ``"package.module:NAME"``, or the name of a registered model.

    Yields
    ------
    Kept
        The outcome: `promise`, `status`, `why`, `seconds`, `text` and `of`. `status` is
        "kept", "broken" or "does not apply".

    Raises
    ------
    ChoiceError
        If there is no such model.
    CodeError
        If the file or one of its entries is not valid.

    Examples
    --------
    >>> outcomes = check_file("vortex.py")
    >>> first = next(outcomes)
    >>> first.promise, first.status
    ('settings', 'kept')
    >>> first.words
    'every parameter has a description, a unit and a range'
    """
    checked = entrants(reference)
    if not checked or has_model(reference):
        yield from check_all(subject(reference))
    for entrant in checked:
        yield from _checked(OFFERED[entrant.kind], entrant, entrant.words)


def check_all(subject: Subject) -> Iterator[Kept]:
    """Yield the outcome of each promise of a model, one after the other.

    If a needed promise is broken, the promises after it do not apply.
    """
    return _checked(ALL, subject)


def _checked(
    promises: Mapping[str, Promise], checked: Subject | Entrant, of: str = ""
) -> Iterator[Kept]:
    lost = ""
    for name, promise in promises.items():
        began = time.perf_counter()
        status = KEPT
        why = ""
        try:
            if lost:
                raise SkipTest(f'"{lost}" must be kept first')
            _check(promise, checked)
        except AssertionError as error:
            status = BROKEN
            why = str(error)
            lost = name if name in NEEDED else ""
        except SkipTest as error:
            status = ELSEWHERE
            why = str(error)
        seconds = time.perf_counter() - began
        yield Kept(name, status, why, seconds, text=promise.text, of=of)


def _check(promise: Promise, checked: Subject | Entrant) -> None:
    """Check a promise of a model or another entry.

    An error that the code raises, or kernels during the check, also breaks the promise.
    """
    try:
        promise.check(checked)
    except (AssertionError, SkipTest, UserError):
        raise
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        if Path(last.filename).parent == Path(__file__).parent:  # an error in a check
            raise
        raise AssertionError(sentence(error)) from error
