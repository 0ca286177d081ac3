"""The options that say where trials run, and the engine that they choose."""

import os
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
    cuda = "cuda"


class Again(StrEnum):
    """Where stored trials fly again."""

    cpu = "cpu"
    cuda = "cuda"


Engine = Annotated[
    EngineKind,
    typer.Option(
        "--executor",
        help=(
            "Processes on this machine, a dask cluster, or processes that share the GPU"
            " of this machine."
        ),
    ),
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
) -> "Iterator[ExecutorFactory]":
    """The engine that the options ask for. It is stopped at the end of the context.

        kind            processes on this machine, a dask cluster, or a GPU
        workers         worker processes; 0 for as many as there are cores
        address         the address of the scheduler, only for dask
        scheduler_file  the file in which the scheduler has written its address, instead

    The command ends if options do not go together, a package is missing, or the
    scheduler does not answer.
    """
    if kind is EngineKind.dask:
        made = _dask(workers, address, scheduler_file)
    else:
        _check_no_cluster(kind, address, scheduler_file)
        made = _cuda(workers) if kind is EngineKind.cuda else _local(workers)
    try:
        yield made
    finally:
        made.stop()


@contextmanager
def engine_again(kind: Again | None, workers: int) -> "Iterator[ExecutorFactory]":
    """The engine by which stored trials fly again: processors, if not a GPU. It is
    stopped at the end of the context. The command ends where there is no GPU.
    """
    made = _cuda(workers) if kind is Again.cuda else _local(workers)
    try:
        yield made
    finally:
        made.stop()


def _check_no_cluster(
    kind: EngineKind, address: str | None, scheduler_file: Path | None
) -> None:
    """End the command where options are given that only a dask cluster has."""
    for option, value in (("--address", address), ("--scheduler-file", scheduler_file)):
        if value is not None:
            way = "add" if kind is EngineKind.local else "give"
            stop(f"{option}: only a dask cluster has one; {way} --executor dask")


def _local(workers: int) -> "ExecutorFactory":
    from sweep.workers.executors import Loky, worker_count

    return Loky(worker_count(workers))


def _cuda(workers: int) -> "ExecutorFactory":
    if find_spec("numba_cuda") is None:
        stop(f"--executor cuda: needs numba-cuda: {installing('gpu')}")
    if os.environ.get("CUDA_VISIBLE_DEVICES") == "":
        stop(
            "--executor cuda: CUDA_VISIBLE_DEVICES is empty, which hides every GPU;"
            " give it the number of one, as CUDA_VISIBLE_DEVICES=0, or unset it"
        )
    from sweep.workers.gpu import Cuda, gpu_problem, gpu_workers

    if problem := gpu_problem():
        stop(f"--executor cuda: {problem}")
    return Cuda(gpu_workers(workers))


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
