"""The options that say where trials run, and the engine that they choose."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.cli.app import stop
from sweep.text import installing

if TYPE_CHECKING:
    from sweep.workers.executors import ExecutorFactory


ADDRESS = re.compile(r"[a-z]+://.+:\d+")


class EngineKind(StrEnum):
    """What runs the trials."""

    local = "local"
    dask = "dask"


Engine = Annotated[
    EngineKind,
    typer.Option("--executor", help="Processes on this machine, or a dask cluster."),
]
Address = Annotated[
    str | None,
    typer.Option(
        metavar="tcp://HOST:PORT",
        help=(
            "Where the scheduler of the dask cluster answers. Who reaches it can run"
            " code on its workers and here: use an inside network, or tls://HOST:PORT."
        ),
    ),
]
SchedulerFile = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="The file in which the scheduler of the dask cluster says so.",
    ),
]


@contextmanager
def engine(
    kind: EngineKind,
    workers: int,
    address: str | None,
    scheduler_file: Path | None,
    threads: int,
) -> "Iterator[ExecutorFactory]":
    """The engine that the options ask for. It is stopped at the end of the context.

        kind            processes on this machine, or a dask cluster
        workers         worker processes; 0 for as many as cores have room for
        address         the address of the scheduler, only for dask
        scheduler_file  the file in which the scheduler has written its address, instead
        threads         of each trial, at most

    The command ends if options do not go together, a package is missing, or the
    scheduler does not answer.
    """
    made = (
        _local(workers, address, scheduler_file, threads)
        if kind is EngineKind.local
        else _dask(workers, address, scheduler_file)
    )
    try:
        yield made
    finally:
        made.stop()


def _local(
    workers: int, address: str | None, scheduler_file: Path | None, threads: int
) -> "ExecutorFactory":
    from sweep.workers.executors import Loky, worker_count

    for option, value in (("--address", address), ("--scheduler-file", scheduler_file)):
        if value is not None:
            stop(f"{option}: only a dask cluster has one; add --executor dask")
    return Loky(worker_count(workers, threads))


def _dask(
    workers: int, address: str | None, scheduler_file: Path | None
) -> "ExecutorFactory":
    if workers:
        stop(
            "--workers: a dask cluster has the workers that were started for it;"
            " leave the option out"
        )
    if (address is None) == (scheduler_file is None):
        stop(
            "--executor dask: give either --address tcp://HOST:PORT or --scheduler-file"
            " FILE"
        )
    if address is not None and not ADDRESS.fullmatch(address):
        stop(
            f"--address {address}: give it as the scheduler prints it, e.g."
            " tcp://10.0.0.1:8786"
        )
    if scheduler_file is not None and not scheduler_file.is_file():
        stop(
            f"{scheduler_file}: no such file; `dask scheduler --scheduler-file"
            f" {scheduler_file}` writes it"
        )
    if find_spec("distributed") is None:
        stop(f"--executor dask: needs dask.distributed: {installing('dask')}")
    from sweep.workers.cluster import Dask

    made = Dask(address, None if scheduler_file is None else str(scheduler_file))
    made.connect()
    return made
