"""Mutants of the program: plain mistakes in our code, each tried on every publication.

The mutants show which mistakes the claims would detect. Each mistake is made in a copy
of our packages, which a separate process runs (DeMillo, Lipton and Sayward 1978,
Computer 11, 34-41). The program is unchanged. The copy has different code hashes. So
results and compiled code of the copy stay separate from the program.
"""

import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import kernels

SWEEP = Path(__file__).parents[1]
KERNELS = Path(kernels.__file__).parent
HOLDER = SWEEP.parent
"""Folder that has the two packages, at any depth."""
NO_CODE = ("__pycache__", "experiments")
OF_TRIALS = ("sweep/design/", "sweep/trial/")
"""Folders in which a mistake changes trials without a change of ids."""


class ProgramMutant(NamedTuple):
    """A mistake in one file of `kernels/` or `sweep/`.

    Each occurrence of the text `right` becomes `wrong`. `description` describes the
    mistake.
    """

    description: str
    file: str
    right: str
    wrong: str

    def changed(self, needed: Iterable[str], same: Iterable[str]) -> set[str]:
        """Return the specs whose trials a copy with the mistake has to run.

        Parameters
        ----------
        needed : iterable of str
            Specs whose trials are needed.
        same : iterable of str
            Specs whose stored trials have unchanged code in the copy.
        """
        if self.file.startswith(OF_TRIALS):
            return {*needed}
        return {*needed} - {*same} if self.file.startswith("kernels/") else set()

    def write_copy(self, folder: Path) -> None:
        """Write our packages into `folder`, with the mistake.

        Raises
        ------
        ValueError
            If the file does not have the text to replace.
        """
        for package in (SWEEP, KERNELS):
            place = folder / package.relative_to(HOLDER)
            if not place.exists():  # a wheel has the kernels within sweep
                left_out = shutil.ignore_patterns(*NO_CODE)
                shutil.copytree(package, place, ignore=left_out)
        inside = KERNELS.parent if self.file.startswith("kernels/") else HOLDER
        file = folder / inside.relative_to(HOLDER) / self.file
        text = file.read_text("utf-8")
        if self.right not in text:
            raise ValueError(f"{self.file} does not have {self.right!r}")
        file.write_text(text.replace(self.right, self.wrong), "utf-8")


MEAN_RADIUS = "values[f] = _mean_distance(frames, f, x, y)"
LARGEST_RADIUS = """\
values[f] = 0.0
        for i in range(frames.bodies.shape[2]):
            values[f] = max(values[f], _centre_distance(frames, f, i, x, y))"""

PROGRAM_MUTANTS: Mapping[str, ProgramMutant] = {
    "edge-of-range": ProgramMutant(
        "a neighbour exactly at the range counts if it should not, and vice versa",
        "kernels/neighbours.py",
        "np.nextafter(square, np.inf) if inclusive else square",
        "square if inclusive else np.nextafter(square, np.inf)",
    ),
    "blind-across-borders": ProgramMutant(
        "boids do not perceive each other across periodic boundaries",
        "kernels/torus.py",
        "0.5 * period",
        "2.0 * period",
    ),
    "one-seed": ProgramMutant(
        "all replicates have the random numbers of the first replicate",
        "sweep/design/jobs.py",
        "replicate = 0 if job.literal else job.replicate",
        "replicate = 0",
    ),
    "last-third": ProgramMutant(
        "means are over the last third of a trial, not over the second half",
        "sweep/trial/derived.py",
        "averaged = (2 * frames > steps) | recorded",
        "averaged = (3 * frames > 2 * steps) | recorded",
    ),
    "start-for-end": ProgramMutant(
        "the value of the first frame replaces the value of the last frame",
        "sweep/trial/derived.py",
        "float(value[-1])",
        "float(value[0])",
    ),
    "contact-threshold": ProgramMutant(
        "boids are in contact within twice contact_distance",
        "kernels/metrics/shape.py",
        "n, reach = frames.bodies.shape[2], observation.contact_distance",
        "n, reach = frames.bodies.shape[2], 2.0 * observation.contact_distance",
    ),
    "n-less-1": ProgramMutant(
        "the sum of headings is divided by N - 1 in the polarization",
        "kernels/metrics/motion.py",
        "values[f] = math.sqrt(x * x + y * y) / n",
        "values[f] = math.sqrt(x * x + y * y) / (n - 1)",
    ),
    "largest-radius": ProgramMutant(
        "the radius of a flock is the largest distance from the centre, not the mean",
        "kernels/metrics/shape.py",
        MEAN_RADIUS,
        LARGEST_RADIUS,
    ),
    "radians": ProgramMutant(
        "turn rates are in radians, not in degrees",
        "kernels/metrics/motion.py",
        "values[f] = math.degrees(total / n)",
        "values[f] = total / n",
    ),
    "no-family": ProgramMutant(
        "each claim is judged as if it were the only claim of the publication",
        "sweep/published/verdicts.py",
        "simultaneous_confidence(max(family, 1))",
        "simultaneous_confidence(1)",
    ),
    "swapped-arms": ProgramMutant(
        "the first arm of a difference is subtracted from the second arm",
        "sweep/published/estimates.py",
        "for side in (difference.first, difference.second)",
        "for side in (difference.second, difference.first)",
    ),
    "spread-for-error": ProgramMutant(
        "the standard deviation replaces the standard error",
        "sweep/analysis/estimate.py",
        "sample.variance * (1.0 / sample.n + extra)",
        "sample.variance * (1.0 + extra)",
    ),
}
"""Mutants of the program by name; mutants of a publication have different names."""
