"""Whatever is killed and cut off, the study becomes the undisturbed one: the same rows,
bit by bit, each once.
"""

from pathlib import Path

import pytest

from tests.faults.campaign import OWN, SPEC, Campaign


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
