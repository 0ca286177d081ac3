"""Engines that run the trials of a launch, by the names that `--executor` takes.

An engine is an entry of ENGINES. A package offers an engine as an entry point of the
group `boidsweep.engines`.
"""

import os
import re
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from kernels.registry import Registry
from sweep.errors import WorkersError
from sweep.text import installing
from sweep.workers.executors import ExecutorFactory

MEMBERS = ("workers", "start", "stop", "check", "watch", "flying")
"""Members of an `ExecutorFactory`, which every engine has."""
ADDRESS = re.compile(r"[a-z]+://.+:\d+")


class EngineOptions(NamedTuple):
    """Options of a user for an engine.

    Attributes
    ----------
    workers : int, default 0
        Number of worker processes; 0 for the default number of the engine.
    address : str, optional
        Address of the scheduler of a cluster.
    scheduler_file : Path, optional
        File with the address that the scheduler has written.
    """

    workers: int = 0
    address: str | None = None
    scheduler_file: Path | None = None


class Engine(NamedTuple):
    """One entry of ENGINES.

    Attributes
    ----------
    text : str
        Location of the workers, in a few words.
    make : callable
        Returns the engine for the options. Raises WorkersError before any work if
        options contradict each other, or if a requirement is missing.
    """

    text: str
    make: Callable[[EngineOptions], ExecutorFactory]


def _local(options: EngineOptions) -> ExecutorFactory:
    _check_no_cluster(options, "add")
    from sweep.workers.executors import Loky, worker_count

    return Loky(worker_count(options.workers))


def _cuda(options: EngineOptions) -> ExecutorFactory:
    _check_no_cluster(options, "give")
    if find_spec("numba_cuda") is None:
        raise WorkersError(f"--executor cuda: needs numba-cuda: {installing('gpu')}")
    if os.environ.get("CUDA_VISIBLE_DEVICES") == "":
        raise WorkersError(
            "--executor cuda: CUDA_VISIBLE_DEVICES is empty, which hides every GPU;"
            " set it to the number of a GPU (CUDA_VISIBLE_DEVICES=0), or unset it"
        )
    from sweep.workers.gpu import Cuda, gpu_problem, gpu_workers

    if problem := gpu_problem():
        raise WorkersError(f"--executor cuda: {problem}")
    return Cuda(gpu_workers(options.workers))


def _wasm(options: EngineOptions) -> ExecutorFactory:
    _check_no_cluster(options, "give")
    for package in ("wasmtime", "ziglang"):
        if find_spec(package) is None:
            raise WorkersError(
                f"--executor wasm: needs {package}: {installing('wasm')}"
            )
    from sweep.workers.executors import worker_count
    from sweep.workers.wasm import WebAssembly

    return WebAssembly(worker_count(options.workers))


def _dask(options: EngineOptions) -> ExecutorFactory:
    address = options.address
    scheduler_file = options.scheduler_file
    if options.workers:
        raise WorkersError(
            "--workers: a dask cluster has the workers that were started for it;"
            " leave the option out"
        )
    if (address is None) == (scheduler_file is None):
        raise WorkersError(
            "--executor dask: give either --address tcp://HOST:PORT or --scheduler-file"
            " FILE"
        )
    if address is not None and not ADDRESS.fullmatch(address):
        raise WorkersError(
            f"--address {address}: give it as the scheduler prints it, e.g."
            " tcp://10.0.0.1:8786"
        )
    if scheduler_file is not None and not scheduler_file.is_file():
        raise WorkersError(
            f"{scheduler_file}: no such file; `dask scheduler --scheduler-file"
            f" {scheduler_file}` writes it"
        )
    if find_spec("distributed") is None:
        raise WorkersError(
            f"--executor dask: needs dask.distributed: {installing('dask')}"
        )
    from sweep.workers.cluster import Dask

    engine = Dask(address, None if scheduler_file is None else str(scheduler_file))
    engine.connect()
    return engine


def _check_no_cluster(options: EngineOptions, way: str) -> None:
    """Raise WorkersError for options that only a cluster has."""
    for option, value in (
        ("--address", options.address),
        ("--scheduler-file", options.scheduler_file),
    ):
        if value is not None:
            raise WorkersError(
                f"{option}: only a dask cluster has one; {way} --executor dask"
            )


ENGINES: Registry[Engine] = Registry(
    "boidsweep.engines",
    Engine,
    {
        "local": Engine("processes on this machine", _local),
        "dask": Engine("a dask cluster", _dask),
        "cuda": Engine("processes that share the GPU of this machine", _cuda),
        "wasm": Engine("processes on this machine that run WebAssembly", _wasm),
    },
)
"""Engines by the names that `--executor` takes."""
