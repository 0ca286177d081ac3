"""The options that choose where trials run, and the chosen engine."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from sweep.workers import ExecutorFactory

LOCAL = "local"
"""The default engine."""
PROCESSORS = "cpu"
"""The default engine where trials run again that a device has run."""


def engine_names(beginning: str) -> list[str]:
    """Return the names of engines that start with `beginning`, for a shell."""
    from sweep.workers import ENGINES

    return [name for name in ENGINES if name.startswith(beginning)]


Engine = Annotated[
    str,
    typer.Option(
        "--executor",
        metavar="local|dask|cuda|wasm|NAME",
        autocompletion=engine_names,
        help=(
            "Engine that runs trials: processes on this machine, a dask cluster,"
            " processes that share the GPU of this machine, processes that run"
            " WebAssembly, or an engine of an installed package."
        ),
    ),
]
Address = Annotated[
    str | None,
    typer.Option(
        metavar="tcp://HOST:PORT",
        help=(
            "Address of the dask scheduler. Anybody with access to the scheduler can"
            " run code on the workers and on this machine: use a private network, or"
            " tls://HOST:PORT."
        ),
    ),
]
SchedulerFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="Scheduler file, written by `dask scheduler --scheduler-file`.",
    ),
]


@contextmanager
def engine(
    name: str,
    workers: int,
    address: str | None = None,
    scheduler_file: Path | None = None,
) -> "Iterator[ExecutorFactory]":
    """Make the engine that options choose, and stop it at the end of the context.

    Parameters
    ----------
    name : str
        The name of the engine, or `PROCESSORS`.
    workers : int
        The number of worker processes; 0 for the default of the engine.
    address : str, optional
        The address of the scheduler of a cluster.
    scheduler_file : Path, optional
        The file with the address of the scheduler, instead of `address`.

    Raises
    ------
    WorkersError
        The engine is unknown or incomplete, options exclude each other, a package is
        missing, or a scheduler does not answer.
    """
    from sweep.errors import WorkersError
    from sweep.text import unknown
    from sweep.workers import ENGINES, MEMBERS, EngineOptions

    name = LOCAL if name == PROCESSORS else name
    if name not in ENGINES:
        raise WorkersError(unknown("executor", name, ENGINES))
    factory = ENGINES[name].make(EngineOptions(workers, address, scheduler_file))
    if lacking := [member for member in MEMBERS if not hasattr(factory, member)]:
        raise WorkersError(f'executor "{name}": the engine lacks {", ".join(lacking)}')
    try:
        yield factory
    finally:
        factory.stop()
