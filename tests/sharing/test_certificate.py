"""A certificate says what ran again, and passes if all of it is identical."""

import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Tree

import numpy as np
import pytest

from sweep.replays.bits import BitDifference, differences
from sweep.sharing.certificate import FILES
from sweep.sharing.packing import pack
from sweep.tables.stored_study import StoredStudy
from sweep.tables.trial_rows import StoredTrial
from sweep.trial.result import Result
from tests.commands import sweep
from tests.publications import experiments
from tests.replays.test_verify import next_float, rewrite
from tests.studies import OWN_SMALL, SMALL, launched, relaunch


def certified(folder: Path, *arguments: str) -> tuple[int, str, dict[str, Any]]:
    """The exit code, the messages and the certificate of a command."""
    done = sweep(folder, "certify", *arguments, "--force")
    path = folder / "certificate" / FILES[0]
    return done.returncode, done.stderr, json.loads(path.read_text("utf-8"))


def test_packed_studies_and_publications_have_one_certificate(tmp_path: Path) -> None:
    packed = pack(launched(SMALL, tmp_path / "stored"), tmp_path / "small.zip")
    experiments(tmp_path)
    code, said, content = certified(
        tmp_path, "small.zip", "experiments", "--fraction", "0.5"
    )
    assert (code, content["passed"]) == (0, True)
    assert "figures.py" in said
    [study] = content["studies"]
    assert study["sha256"] == packed.sha256
    assert [study[key] for key in ("study", "stored", "checked", "identical")] == [
        *("small", 6, 3, 3)
    ]
    assert 0.3 < study["differing_at_most"] < 1  # of three trials alone
    assert content["publications"] == [
        {"study": "tiny", "statements": {"confirmed": 1, "not testable": 1}}
    ]
    assert content["summary"] == "3 of 3 trials identical, 1 claim confirmed"
    text = (tmp_path / "certificate" / FILES[1]).read_text("utf-8")
    assert "**Passed:** 3 of 3 trials identical" in text
    assert "| tiny | 1 confirmed, 1 not testable |" in text
    badge = (tmp_path / "certificate" / FILES[2]).read_text("utf-8")
    assert Tree.fromstring(badge).get("aria-label") == (
        "boidsweep: 3 of 3 trials identical, 1 claim confirmed"
    )


def test_a_trial_that_differs_fails_the_certificate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of six trials has another speed, by a last bit."""
    study = launched(SMALL, tmp_path)
    first = study.trials["trial_id"].iloc[0]
    pack(study, tmp_path / "small.zip")

    def compare(name: str, stored: StoredTrial, result: Result) -> list[BitDifference]:
        if stored.row["trial_id"] == first:
            stored.row["speed"] = np.nextafter(stored.row["speed"], np.inf)
        return differences(name, stored, result)

    monkeypatch.setattr("sweep.replays.verifying.differences", compare)
    code, _, content = certified(tmp_path, "small.zip", "--fraction", "1")
    assert (code, content["passed"]) == (1, False)
    assert content["summary"] == "5 of 6 trials identical"
    [study] = content["studies"]
    assert study["differing_at_most"] == 1 / 6  # all were compared


def test_a_study_that_changed_in_the_file_is_not_compared(tmp_path: Path) -> None:
    changed = rewrite(launched(SMALL, tmp_path), "series", "speed", next_float)
    pack(changed, tmp_path / "small.zip")
    code, _, content = certified(tmp_path, "small.zip")
    assert (code, content["passed"]) == (1, False)
    assert content["summary"] == "0 of 0 trials identical, 1 file not compared"


def test_what_cannot_be_compared_fails_the_certificate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Custom code of others runs only with --trust, and a damaged file never."""
    relaunch(OWN_SMALL, tmp_path / "own")
    pack(StoredStudy("small", tmp_path / "own"), tmp_path / "own.zip")
    (tmp_path / "damaged.zip").write_bytes(b"PK")
    monkeypatch.setattr("sweep.store.stored_code.own_key", lambda: b"somebody else")
    code, _, content = certified(tmp_path, "own.zip", "damaged.zip")
    assert (code, content["passed"]) == (1, False)
    assert content["summary"] == "0 of 0 trials identical, 2 files not compared"
    reasons = [study["error"] for study in content["studies"]]
    assert "--trust" in reasons[0]
    assert "damaged.zip" in reasons[1]
    code, _, content = certified(tmp_path, "own.zip", "--trust")
    assert (code, content["summary"]) == (0, "1 of 1 trial identical")


def test_wrong_sources_are_refused_together_and_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    done = sweep(tmp_path, "certify", "absent.zip", "empty")
    assert done.returncode == 2
    assert "absent.zip: no file" in done.stderr
    assert "empty: no folder in it has a published.yaml" in done.stderr
    assert not (tmp_path / "certificate").exists()
    (tmp_path / "small.zip").write_bytes(b"")
    (tmp_path / "certificate").mkdir()
    (tmp_path / "certificate" / FILES[1]).touch()
    done = sweep(tmp_path, "certify", "small.zip")
    assert done.returncode == 2
    assert "certificate.md exists already; --force replaces it" in done.stderr
