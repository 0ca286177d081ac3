"""The engine of a GPU: worker processes on this machine that share the GPU.

The coordinator queries the GPU, but runs no trial there.
"""

from dataclasses import dataclass
from functools import cache

from sweep.workers.executors import Loky, core_count
from sweep.workers.on_device import OnDevice

LEAST_WORKERS = 2
MOST_WORKERS = 16
"""Bounds of the default number of workers.

The default is one worker per core, because the preparation of trials takes processors.
With a single worker the GPU would idle. Each worker holds memory of the GPU, some
hundred megabytes before its first trial.
"""


@dataclass
class Cuda(Loky):
    """The engine of a GPU for CUDA: the first GPU that this process sees.

    The `workers` processes on this machine share the GPU.
    """

    @property
    def flying(self) -> OnDevice:
        """Way in which the workers run trials: in batches on the GPU."""
        from sweep.trial import MOST_ON_DEVICE, DeviceTrials, gpu, refusal_of

        return OnDevice(DeviceTrials(gpu), refusal_of, MOST_ON_DEVICE, this_gpu())


def gpu_problem() -> str:
    """Return why this machine has no GPU that runs trials; "" if there is a GPU."""
    from sweep.trial import problem

    return problem()


def gpu_workers(workers: int) -> int:
    """Return the number of workers that share the GPU.

    0 means one per core, within LEAST_WORKERS and MOST_WORKERS.
    """
    return workers or min(max(LEAST_WORKERS, core_count()), MOST_WORKERS)


@cache
def this_gpu() -> dict[str, str]:
    """Return the name of the GPU, the CUDA version of its driver, and library versions.

    The libraries compile code for the GPU. The results of a trial on the GPU may depend
    on all versions.
    """
    from sweep.trial import gpu

    device = gpu()
    major, minor = divmod(device.driver, 1000)
    return {
        "name": device.name,
        "driver": f"{major}.{minor // 10}",
        **device.versions,
    }
