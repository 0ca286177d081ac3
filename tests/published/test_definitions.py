"""What is recorded of trials, held to its definitions."""

from pathlib import Path

import numpy as np
import pytest

from sweep.campaigns.launching import launch
from sweep.published.definitions import DEFINITIONS, as_defined
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial

SPEC = """
study: tiny
model: nguyen2024
fixed: {n: 30, steps: 7, contact_distance: 60}
sweep: {separation_weight: [0.5, 1]}
replicates: 3
seed: 5
record:
  metrics: [polarization, flock_radius, in_contact]
  series: [speed]
  every: 2
  trajectories: true
"""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("results")
    launch(parse_spec(SPEC), folder, Serial())
    return folder


def shares(study: StoredStudy) -> list[float]:
    return as_defined({"small": study}, "small").tolist()


def test_what_the_program_records_is_as_defined(results: Path) -> None:
    study = StoredStudy("tiny", results)
    contact = study.trials["in_contact"]
    assert ((contact > 0.0) & (contact < 100.0)).all()
    assert shares(study) == [100.0] * 6


@pytest.mark.parametrize(
    ("column", "factor"),
    [
        ("polarization", 30 / 29),
        ("flock_radius", 1.5),
        ("in_contact", 1.5),
        ("in_contact_mean", 0.9),
        ("speed", 0.99),
        ("speed_mean", 1.00001),
    ],
)
def test_another_value_is_not(results: Path, column: str, factor: float) -> None:
    study = StoredStudy("tiny", results)
    study.trials.loc[4, column] *= factor
    assert shares(study) == [100.0, 100.0, 100.0, 100.0, 0.0, 100.0]


def test_neither_is_a_replicate_that_repeats_another_one(results: Path) -> None:
    """Its numbers and its frames are those of the first of its point."""
    study = StoredStudy("tiny", results)
    same = {**study.trials.loc[0], "replicate": 1}
    study.trials.loc[1] = same
    assert shares(study) == [100.0, 0.0, 100.0, 100.0, 100.0, 100.0]


def test_trials_that_are_not_done_say_nothing(results: Path) -> None:
    study = StoredStudy("tiny", results)
    study.trials.loc[2, "status"] = "failed"
    assert shares(study) == [100.0] * 5


def test_a_study_without_frames_is_an_error(tmp_path: Path) -> None:
    bare = SPEC.replace("  series: [speed]\n", "").replace("trajectories: true", "")
    launch(parse_spec(bare.replace("  \n", "")), tmp_path, Serial())
    with pytest.raises(ValueError, match=r"^tiny stores neither series nor traj"):
        shares(StoredStudy("tiny", tmp_path))


def test_perfect_order_and_rest_have_their_known_polarization() -> None:
    """Of the definition itself: 1 where all head one way, 0 of two that are opposed,
    and a boid at rest counts as a zero vector.
    """
    one_way = np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 1.0], [0.0, 0.0]])
    opposed = np.array([[0.0, 0.0], [0.0, 0.0], [2.0, -2.0], [0.0, 0.0]])
    resting = np.array([[0.0, 0.0], [0.0, 0.0], [2.0, 0.0], [0.0, 0.0]])
    bodies = np.stack([one_way, opposed, resting])
    found = DEFINITIONS["polarization"](bodies, None)  # type: ignore[arg-type]
    assert found == pytest.approx([1.0, 0.0, 0.5])
