"""Flocks that are followed from frame to frame, and the table of who changes."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.errors import ChoiceError, OutputError
from sweep.tables.flock_changes import write_flock_changes
from sweep.trial.following import followed
from tests.commands import sweep
from tests.naive.metrics import flocks
from tests.studies import SMALL, launched

FLOWN = SMALL.replace(
    "every: 2}", "metrics: [fissions, fusions], trajectories: true, every: 2}"
).replace("steps: 9", "steps: 99, flock_range: 150")


def flight(*places: list[float]) -> np.ndarray:
    """A trajectory of boids on a line, at these x in each frame."""
    bodies = np.zeros((len(places), 4, len(places[0])))
    bodies[:, 0] = places
    return bodies


def slow_numbers(bodies: np.ndarray, reach: float) -> list[list[int]]:
    """The numbers of flocks by sets of members, flock after flock."""
    known = dict[frozenset[int], int]()
    numbers, given = [], 0
    for frame in bodies:
        found = sorted(map(frozenset, flocks(frame, reach)), key=min)
        now = dict[frozenset[int], int]()
        for new in found:
            old = max(known, key=lambda one: (len(one & new), -min(one)), default=None)
            if old and old & new:
                heir = max(found, key=lambda one: (len(one & old), -min(one)))
                if heir == new:
                    now[new] = known[old]
            if new not in now:
                now[new], given = given, given + 1
        known = now
        of = {boid: number for one, number in known.items() for boid in one}
        numbers.append([of[boid] for boid in range(bodies.shape[2])])
    return numbers


def test_a_flock_goes_on_as_the_one_that_has_most_of_its_members() -> None:
    """Seven in one; three leave, and one of them comes back; then the others too, one
    by one: of a pair that parts evenly the part with the smaller index goes on.
    """
    one = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    parted = [*one[:4], 90.0, 91.0, 92.0]
    back = [*one[:5], 91.0, 92.0]
    seen = followed(flight(one, parted, back, [*one[:6], 92.0], one), 10.0)
    assert seen.flock.tolist() == [
        [0] * 7,
        [0, 0, 0, 0, 1, 1, 1],
        [0, 0, 0, 0, 0, 1, 1],
        [0, 0, 0, 0, 0, 0, 2],
        [0] * 7,
    ]
    assert seen.fissions.tolist() == [0, 1, 2, 3, 3]
    assert seen.fusions.tolist() == [0, 0, 1, 2, 3]


def test_the_smaller_of_two_flocks_joins_and_its_number_ends() -> None:
    """Two and three join, and part otherwise: the part of three goes on."""
    apart, joined = [0.0, 1.0, 50.0, 51.0, 52.0], [0.0, 1.0, 2.0, 3.0, 4.0]
    seen = followed(flight(apart, joined, [0.0, 1.0, 2.0, 50.0, 51.0]), 10.0)
    assert seen.flock.tolist() == [[0, 0, 1, 1, 1], [1] * 5, [1, 1, 1, 2, 2]]


@pytest.mark.parametrize("seed", range(5))
def test_flocks_are_those_of_a_slow_twin(seed: int) -> None:
    """Boids that walk at random on a line, some thirty frames of which change."""
    rng = np.random.default_rng(seed)
    walks = rng.uniform(0, 200, 12) + rng.normal(0, 8, (40, 12)).cumsum(axis=0)
    seen = followed(flight(*walks.tolist()), 15.0)
    assert seen.flock.tolist() == slow_numbers(flight(*walks.tolist()), 15.0)
    flocks_now = [len(set(row)) for row in seen.flock.tolist()]
    changed = seen.fissions - seen.fusions
    assert (np.array(flocks_now) - flocks_now[0]).tolist() == changed.tolist()
    assert (np.diff(seen.fissions) > 0).sum() > 10


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_the_table_has_who_changes(tmp_path: Path, ending: str) -> None:
    """Its frames are those in which the metrics count, and the sums are the same."""
    study = launched(FLOWN, tmp_path / "results")
    done = write_flock_changes(study, tmp_path / f"changes.{ending}")
    read = pd.read_csv if ending == "csv" else pd.read_parquet
    table = read(tmp_path / f"changes.{ending}")
    assert len(table) == done.rows > 0
    assert done.trials == len(study.trials)
    assert done.fissions == study.trials["fissions"].sum() > 0
    assert done.fusions == study.trials["fusions"].sum()
    for trial, rows in table.groupby("trial_id"):
        frames, bodies = study.trajectory(str(trial))
        flock = followed(bodies, 150.0).flock
        for row in rows.itertuples():
            now = list(frames).index(row.frame)
            assert row.time == row.frame * study.trials["dt"].iloc[0]
            assert flock[now - 1, row.boid] == row.from_flock
            assert flock[now, row.boid] == row.to_flock != row.from_flock
        assert len(rows) == (flock[1:] != flock[:-1]).sum()


def test_the_command_writes_changes(tmp_path: Path) -> None:
    launched(FLOWN, tmp_path / "results")
    done = sweep(tmp_path, "flocks", "small", "--changes", "--to", "changes.csv")
    assert "of flock in changes.csv; in 6 trials flocks parted" in done.stderr
    assert len(pd.read_csv(tmp_path / "changes.csv")) > 0


def test_a_study_without_trajectories_is_refused(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    with pytest.raises(
        ChoiceError, match=r"record: \{trajectories: true\} in the spec"
    ):
        write_flock_changes(study, tmp_path / "changes.csv")
    with pytest.raises(OutputError, match=r'unknown kind of file "\.npz"'):
        write_flock_changes(study, tmp_path / "changes.npz")
    assert not (tmp_path / "changes.csv").exists()
