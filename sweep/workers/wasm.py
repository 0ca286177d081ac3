"""The engine of WebAssembly: worker processes on this machine that run modules.

Results are bitwise identical to results of processors, and come three to seven times
slower. The engine shows that
a model runs in a browser with the results of a study.
"""

from dataclasses import dataclass
from importlib.metadata import version

from sweep.workers.executors import Loky
from sweep.workers.on_device import OnDevice

AT_ONCE = 16
"""Largest number of trials of a batch, which run in sequence."""


@dataclass
class WebAssembly(Loky):
    """The engine of WebAssembly: processes on this machine."""

    @property
    def flying(self) -> OnDevice:
        """Way in which the workers run trials: in batches, as WebAssembly."""
        from sweep.trial import DeviceTrials, refusal_of_wasm, wasm

        device = {
            "name": "WebAssembly",
            "wasmtime": version("wasmtime"),
            "ziglang": version("ziglang"),
        }
        trials = DeviceTrials(wasm)
        return OnDevice(trials, refusal_of_wasm, AT_ONCE, device, called="WebAssembly")
