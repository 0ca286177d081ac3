"""Flocks with which the trials of a point have ended, where others start."""

from pathlib import Path

import numpy as np
import pytest

from examples import swarmalators
from sweep.campaigns.launching import launch
from sweep.errors import ChoiceError, OutputError
from sweep.tables.last_flocks import write_last_flocks
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import failed
from sweep.trial.simulation import run
from sweep.workers.executors import Serial
from tests.commands import sweep
from tests.searches import replace_trials
from tests.studies import SMALL, launched, read, relaunch

KEPT = SMALL.replace("every: 2}", "trajectories: true, last_flocks: true}")
NEXT = KEPT.replace("study: small", "study: next").replace(
    "steps: 9", "steps: 4, start_draws: ./flocks.csv"
)


def test_replicates_start_where_those_of_another_study_have_ended(
    tmp_path: Path,
) -> None:
    first = launched(KEPT, tmp_path / "results").where(separation_weight=0.5)
    done = write_last_flocks(first, tmp_path / "flocks.csv")
    assert done == (3, 12)
    (tmp_path / "next.yaml").write_text(NEXT)
    launch(read(tmp_path / "next.yaml"), tmp_path / "results", Serial())
    second = StoredStudy("next", tmp_path / "results")
    ends = {
        row.replicate: first.trajectory(row.trial_id)[1][-1]
        for row in first.trials.itertuples()
    }
    assert len(ends) == 3
    assert len(second.trials) == 6
    for row in second.trials.itertuples():
        _, bodies = second.trajectory(row.trial_id)
        assert bodies[0].tobytes() == ends[row.replicate].tobytes()
    assert len({end.tobytes() for end in ends.values()}) == 3


def test_the_command_writes_them_for_one_point(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(KEPT)
    sweep(tmp_path, "launch", "spec.yaml")
    where = ("--where", "separation_weight=1")
    done = sweep(tmp_path, "flocks", "small", *where, "--to", "flocks.csv")
    assert done.stderr == "3 flocks of 12 boids in flocks.csv\n"
    table = np.genfromtxt(tmp_path / "flocks.csv", delimiter=",", skip_header=1)
    assert table.shape == (36, 5)
    assert table[:, 0].tolist() == np.repeat([0, 1, 2], 12).tolist()
    again = sweep(tmp_path, "flocks", "small", *where, "--to", "flocks.csv")
    assert again.stderr == "flocks.csv: exists already; --force replaces it\n"
    forced = sweep(tmp_path, "flocks", "small", *where, "--to", "flocks.csv", "--force")
    assert forced.returncode == 0


def test_several_points_and_another_ending_are_refused(tmp_path: Path) -> None:
    study = launched(KEPT, tmp_path)
    with pytest.raises(ChoiceError, match="has 2 points, which differ in separation_w"):
        write_last_flocks(study, tmp_path / "flocks.csv")
    with pytest.raises(OutputError, match=r'unknown kind of file "\.npz"'):
        write_last_flocks(study, tmp_path / "flocks.npz")
    assert not (tmp_path / "flocks.csv").exists()


def test_trials_that_keep_no_flocks_are_refused(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path).where(separation_weight=1)
    with pytest.raises(ChoiceError, match="3 trials without stored last_flocks; re"):
        write_last_flocks(study, tmp_path / "flocks.csv")


def test_trials_that_are_not_done_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_trials(
        monkeypatch,
        lambda job: failed(job, "it rains") if job.replicate == 1 else run(job),
    )
    relaunch(KEPT + "on_error: record\n", tmp_path)
    study = StoredStudy("small", tmp_path).where(separation_weight=1)
    with pytest.raises(ChoiceError, match="1 trial of 3 not done: it rains"):
        write_last_flocks(study, tmp_path / "flocks.csv")


@pytest.mark.slow
def test_boids_with_a_state_are_refused(tmp_path: Path) -> None:
    """With all other reasons at once."""
    (tmp_path / "own.py").write_text(Path(swarmalators.__file__).read_text())
    spec = tmp_path / "own.yaml"
    spec.write_text(
        "study: own\nmodel: ./own.py\nfixed: {n: 4, steps: 3}\nreplicates: 2\n"
        "sweep: {start_speed: [0, 1]}\nrecord: {last_flocks: true}\n"
    )
    launch(read(spec), tmp_path, Serial())
    with pytest.raises(ChoiceError) as caught:
        write_last_flocks(StoredStudy("own", tmp_path), tmp_path / "flocks.csv")
    points, state = str(caught.value).splitlines()
    assert "has 2 points" in points
    assert "have a state (phase), which a table" in state
