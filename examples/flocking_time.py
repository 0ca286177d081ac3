"""Time the flocking benchmark of JuliaDynamics: the median of 100 seeds, in ms.

A trial has 100 steps. The time of a trial includes its initial flock, and excludes the
compilation and the storage.

    python examples/flocking_time.py
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import sweep

MODEL = Path(__file__).with_name("flocking.py")
TRIALS = 100


def main() -> None:
    """Print one line per size, in the form of the benchmark."""
    for size in ("small", "large"):
        print(f"boidsweep Flocking-{size} (ms): {1000 * median_seconds(size):.3f}")


def median_seconds(size: str) -> float:
    """Return the median time of a trial, in s.

    Parameters
    ----------
    size : str
        Preset of the model, "small" or "large".
    """
    spec = {
        "study": f"my/flocking_{size}",
        "model": f"./{MODEL.name}",
        "preset": size,
        "replicates": TRIALS,
        "seed": 42,
        "record": {"metrics": ["polarization"]},
    }
    with TemporaryDirectory() as folder:
        file = Path(folder) / "spec.yaml"
        (Path(folder) / MODEL.name).write_bytes(MODEL.read_bytes())
        file.write_text(repr(spec), encoding="utf-8")
        study = sweep.run(file, Path(folder) / "results", workers=1)
        return float(study.trials["seconds"].median())


if __name__ == "__main__":
    main()
