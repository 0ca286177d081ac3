"""Whatever is killed and cut off, the study becomes the undisturbed one: the same rows,
bit by bit, each once.
"""

from pathlib import Path

import pytest

from sweep.loaded import LoadedStudy
from tests.commands import started
from tests.faults.campaign import CALIBRATED, DATA, OWN, SPEC, Campaign, tables
from tests.studies import launched


@pytest.mark.slow
def test_a_study_survives_kills_and_truncations(tmp_path: Path) -> None:
    """The moments are drawn, so on another machine a launch may be over before its
    kill: then there is another one.
    """
    campaign = Campaign(tmp_path, seed=2, spec=OWN)
    while not (
        campaign.counts["worker kills"] and campaign.counts["coordinator kills"]
    ):
        assert campaign.counts["studies"] < 10
        campaign.study(launches=1)


@pytest.mark.slow
@pytest.mark.parametrize("spec", [SPEC, OWN], ids=["ours", "own code"])
def test_many_studies_survive_dozens_of_kills_and_truncations(
    spec: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """At least 50 kills of the coordinator, 50 of workers and 25 truncations, and what
    was done is printed. Each study takes a minute, mostly of waiting.
    """
    campaign = Campaign(tmp_path, seed=1, spec=spec)
    wanted = {"coordinator kills": 50, "worker kills": 50, "truncations": 25}
    while any(campaign.counts[what] < number for what, number in wanted.items()):
        campaign.study(launches=8)
        with capsys.disabled():
            done = ", ".join(
                f"{count} {what}" for what, count in sorted(campaign.counts.items())
            )
            print(f"\nfault campaign: {done}", flush=True)


@pytest.mark.slow
def test_a_calibration_has_the_same_posterior_after_twenty_kills(
    tmp_path: Path,
) -> None:
    campaign = Campaign(tmp_path, seed=3, spec=CALIBRATED, data=DATA)
    while campaign.counts["coordinator kills"] + campaign.counts["worker kills"] < 20:
        campaign.study(launches=8)
    whole = LoadedStudy("faulty", tmp_path / "undisturbed").posterior()
    for place in sorted(tmp_path.glob("study-*")):
        posterior = LoadedStudy("faulty", place / "results").posterior()
        assert posterior.draws.equals(whole.draws)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2, 8])
def test_a_calibration_has_the_same_posterior_with_any_number_of_workers(
    workers: int, tmp_path: Path
) -> None:
    (tmp_path / "spec.yaml").write_text(CALIBRATED)
    launched(DATA, tmp_path / "results")
    launched(DATA, tmp_path / "alone")
    launched(CALIBRATED, tmp_path / "alone")
    done = started(tmp_path, "launch", "spec.yaml", "--workers", str(workers))
    assert done.returncode == 0, done.stderr
    folders = [tmp_path / name / "faulty" for name in ("results", "alone")]
    assert tables(folders[0]) == tables(folders[1])
    draws = [
        LoadedStudy("faulty", folder.parent).posterior().draws for folder in folders
    ]
    assert draws[0].equals(draws[1])
