"""The check that a step is compiled without allocation, and equals plain Python.

Compiled and plain Python are compared bit by bit.
"""

import tempfile
from pathlib import Path
from typing import Any
from unittest import SkipTest

from sweep.design import Job
from sweep.testing.elsewhere import run_elsewhere
from sweep.testing.flights import difference, every_way, fly, go, in_words
from sweep.testing.interpreted import read
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial import Simulation

ARGUMENTS = ("flock", "world", "params", "work", "record", "rng", "steps")
MANY = 400
BOIDS = 20
PROGRAM = "sweep.testing.interpreted"


def allocation(subject: Subject) -> None:
    """Check that `advance` is compiled without memory management or allocation.

    `kernels.jit.jit` rejects code that allocates. The counters of numba confirm the
    absence of allocation over many steps.
    """
    advance: Any = subject.model.advance
    place = of_function(advance)
    check_compiled(advance, "advance")
    taken = advance.py_func.__code__.co_argcount
    if taken != len(ARGUMENTS):
        raise AssertionError(
            f"{place}: advance takes {taken} arguments, but gets"
            f" {len(ARGUMENTS)}: {', '.join(ARGUMENTS)}"
        )
    for job in every_way(subject, n=BOIDS, steps=MANY):
        check_steps(subject, job)


def check_compiled(function: Any, name: str) -> None:
    """Raise AssertionError unless `kernels.jit.jit` compiles a function."""
    options = getattr(function, "targetoptions", None)
    if options is None:
        raise AssertionError(
            f"{of_function(function)}: {name} is plain Python; write @jit of"
            " kernels.jit above the function"
        )
    if options.get("_nrt", True):
        raise AssertionError(
            f"{of_function(function)}: {name} is compiled with memory management; use"
            " @jit of kernels.jit, which rejects code that allocates"
        )


def check_steps(subject: Subject, job: Job) -> None:
    """Raise AssertionError if `advance` returns no boolean, or allocates per step.

    Many steps must allocate no more blocks than one step.
    """
    advance: Any = subject.model.advance
    place = of_function(advance)
    simulation = Simulation(job)
    go(simulation, 1)
    [result, *_] = {signature.return_type for signature in advance.nopython_signatures}
    if str(result) != "bool":
        raise AssertionError(
            f"{place}: advance returns {result}; return False if observe returns False"
            " (the step is not finite), and True at the end"
        )
    # A call takes one block for any number of steps.
    few, many = (_blocks(simulation, steps) for steps in (1, MANY - 2))
    if many > few:
        raise AssertionError(
            f"{place}: {MANY - 2} steps have allocated {many - few:,} blocks of memory"
            " more than one step; write into arrays of work or of the flock instead"
        )


def _blocks(simulation: Simulation, steps: int) -> int:
    """Return the number of blocks of memory allocated in a call."""
    before = _allocated()
    simulation.advance(steps)
    return _allocated() - before


def _allocated() -> int:
    """Return the number of blocks that compiled code has allocated so far."""
    from numba.core import runtime

    counted: Any = runtime
    counted._nrt_python.memsys_enable_stats()
    return int(counted.rtsys.get_allocation_stats().alloc)


def interpreter(subject: Subject) -> None:
    """Check that a compiled model is bitwise identical to plain Python.

    Plain Python runs in another process, without compilation.
    """
    if not subject.reference:
        raise SkipTest("a Model without a file is known only in this process")
    place = of_function(subject.model.advance)
    jobs = list(every_way(subject))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "flights.npz"
        names = subject.reference, str(file)
        run_elsewhere("in plain Python", PROGRAM, *names, NUMBA_DISABLE_JIT="1")
        plain = read(file)
    for job, theirs in zip(jobs, plain, strict=True):
        if mismatch := difference(fly(job), theirs, "compiled", "in plain Python"):
            raise AssertionError(
                f"{place}: {mismatch} ({in_words(job)}); write x * x * x for x**3,"
                " loops for sums of NumPy, and integers below 2**63"
            )
