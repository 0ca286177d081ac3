"""The physics: flocks, rules, worlds and metrics as numba kernels. Reads no file, prints nothing, validates nothing.

    state       Flock, World, Schedule: what enters kernels      jit           how they are compiled
    neighbours  who sees whom                                    arbitration   how forces share one acceleration
    rules/      social, steering, obstacles, borders             models/       one file a published model
    worlds      maps -> World                                    starts        initial flocks
    metrics     recorded frames -> numbers                       coverage      visited pixels

numba's disk cache does not notice that a called function changed in another file (numba issue 1833), so cached code
lives in a folder named by the hash of all kernel sources. The same hash is recorded with every result.
"""

import hashlib
import os
from pathlib import Path

import numba


def source_stamp(folder: Path) -> str:
    """The sha256 of all Python sources below `folder`, names included, as 64 hexadecimal digits."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        source = path.read_bytes()
        digest.update(f"{path.relative_to(folder).as_posix()} {len(source)}\n".encode())
        digest.update(source)
    return digest.hexdigest()


KERNELS_SHA = source_stamp(Path(__file__).parent)


def _cache_folder() -> Path:
    home = Path(os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "boidsweep" / KERNELS_SHA[:16]


setattr(numba.config, "CACHE_DIR", str(_cache_folder()))  # noqa: B010  numba declares it at run time
