"""Trials in worker processes, on this machine or on a cluster.

No trial is lost, and no trial is stored twice.

    attempts           runs trials and stores results; runs failed trials again
    runner             the loop that hands out jobs and collects results

    chunks             divides jobs into portions of about equal work or number

    failures           how many failed trials a study may have
    fingerprint        the code and libraries that must be equal everywhere

    engines            the engines that run trials, by name

    executors          engines on this machine: a pool of processes, or none
    on_device          trials on a device, to which workers send batches
    gpu                the engine of a GPU, which a pool of processes shares
    wasm               the engine of WebAssembly

    flying             how the workers of an engine run trials; on processors
    worker             runs a chunk of jobs in a worker
    watch              ends a worker whose job exceeds a limit

    checkpoint         lets long trials resume after an interruption
    checkpoint_file    the format of a checkpoint
    checkpoint_folder  which checkpoints exist, and which are deleted

    last_state         lets trials with more steps resume from trials with fewer

    cluster            the engine of a dask cluster
    connection         a connection to its scheduler, made within a time limit

    tasks              the tasks of a launch on the cluster

    remote             runs a chunk in a worker of the cluster
    warden             ends a worker of the cluster whose job exceeds a limit
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
