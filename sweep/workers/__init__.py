"""Trials in worker processes, on this machine or on a cluster.

No trial is lost, and none is stored twice.

    attempts           runs trials and stores them; runs failed trials again
    runner             the loop that hands jobs out and takes results back
    chunks             divides jobs into portions of about equal work or number
    engines            the engines that run trials, by their names
    executors          engines on this machine: a pool of processes, or none
    flying             how the workers of an engine run trials; on processors
    gpu                the engine of a GPU, which a pool of processes shares
    worker             runs a chunk of jobs in a worker
    watch              ends a worker whose job is beyond a limit
    failures           how many failed trials a study may have
    fingerprint        the code and libraries that must be equal everywhere
    checkpoint         lets long trials resume after an interruption
    checkpoint_file    the format of a checkpoint
    checkpoint_folder  which checkpoints exist, and which are deleted
    last_state         lets trials with more steps resume from trials with fewer
    cluster            the engine of a dask cluster
    connection         a connection to its scheduler, made within a time limit
    tasks              our tasks on the cluster
    remote             runs a chunk in a worker of the cluster
    warden             ends a worker of the cluster whose job is beyond a limit
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
