"""What versions 0.13.0 and 0.18.0 stored is read, checked and extended by this version.

`stored/0.13.0/README.md` says how the stores were made. What each version said of them
is expected. The kernels of 0.18.0 are those of today, so that its trials have the ids
and the bits of today: a new name of anything that an id covers would be noticed here.
"""

import shutil
from pathlib import Path
from subprocess import CompletedProcess

import pandas as pd
import pytest

import sweep
from tests.cases import slow_but
from tests.commands import sweep as command
from tests.earlier_stores import STORED, alike, columns_of, equal, long

COMMITS = {
    "0.13.0": "0de82458f89bffe356f5a71ff8ac1e92ed08f373",
    "0.18.0": "599a68d2e8085d3018d89f778e3a8c28547e527f",
}
CSV = {
    (version, path.parent.name, path.stem): path
    for version in COMMITS
    for path in sorted((STORED / version / "expected").glob("*/*.csv"))
}
TRIALS = {
    ("0.13.0", "own"): 4,
    ("0.13.0", "ended"): 4,
    ("0.13.0", "gains"): 33,
    ("0.18.0", "own"): 4,
    ("0.18.0", "gains"): 33,
    ("0.18.0", "loop"): 18,
    ("0.18.0", "robots"): 10,
    ("0.18.0", "edge"): 12,
    ("0.18.0", "steps"): 4,
}
OF_TODAY = [name for version, name in TRIALS if version == "0.18.0" and name != "own"]
"""Studies of built-in models and metrics."""
REPORTS = {
    ("0.13.0", "gains", "search"): ("search", "specs/gains.yaml"),
    ("0.18.0", "gains", "search"): ("search", "specs/gains.yaml"),
    ("0.18.0", "own", "table"): ("table", "own"),
    ("0.18.0", "edge", "boundary"): ("boundary", "edge"),
    ("0.18.0", "robots", "compare"): ("compare", "robots:as_run", "robots:detail=late"),
}
OTHER = r"/(held_out_)?(low|high)$"
"""Of three coverages that judge a candidate two are equal. Intervals of such values are
others now.
"""
WORDS = "^/method/interval$"
"""The description of the confidence intervals of a comparison."""


def copied(version: str, folder: Path) -> Path:
    """A folder with a copy of the stores of a version, and of their specs."""
    for part in ("studies", "specs"):
        shutil.copytree(STORED / version / part, folder / part)
    return folder


def done(here: Path, *arguments: str) -> CompletedProcess[str]:
    """A command that has succeeded with the copied stores as its results."""
    ended = command(here, *arguments, "--results", "studies")
    assert ended.returncode == 0, ended.stderr
    return ended


def launched(here: Path, study: str) -> str:
    """What a launch says, or a search."""
    verb = "search" if study == "gains" else "launch"
    return done(here, verb, f"specs/{study}.yaml").stderr


def unchanged(here: Path, version: str, study: str) -> None:
    """Assert that the stored rows are those of then, to the last bit. A trial that ran
    again would have taken other `seconds`.
    """
    for (of_version, name, table), path in CSV.items():
        if (of_version, name) == (version, study):
            columns = columns_of(path)
            frame = long(sweep.load(study, here / "studies"), table)
            equal(frame[frame["trial_id"].isin(columns["trial_id"])], columns)


@pytest.mark.parametrize(("version", "study"), TRIALS)
def test_the_stores_are_those_of_their_version(version: str, study: str) -> None:
    stored = sweep.load(study, STORED / version / "studies")
    assert stored.provenance["versions"]["boidsweep"] == version
    assert stored.provenance["git"]["commit"] == COMMITS[version]
    assert stored.statuses() == {"done": TRIALS[version, study]}


@pytest.mark.parametrize("which", CSV, ids="-".join)
def test_every_value_is_read_as_then(which: tuple[str, str, str]) -> None:
    version, study, table = which
    stored = sweep.load(study, STORED / version / "studies")
    equal(long(stored, table), columns_of(CSV[which]))


@pytest.mark.parametrize("which", CSV, ids="-".join)
def test_tables_are_exported_as_then(
    which: tuple[str, str, str], tmp_path: Path
) -> None:
    version, study, table = which
    here = copied(version, tmp_path)
    done(here, "export", study, "--table", table, "--to", "now.csv")
    found, wanted = pd.read_csv(here / "now.csv"), pd.read_csv(CSV[which])
    pd.testing.assert_frame_equal(found, wanted, check_exact=True)


@pytest.mark.parametrize("study", OF_TODAY)
def test_the_same_spec_runs_nothing(study: str, tmp_path: Path) -> None:
    here = copied("0.18.0", tmp_path)
    assert f"{study}: nothing was missing" in launched(here, study)
    unchanged(here, "0.18.0", study)


@pytest.mark.slow
@pytest.mark.parametrize("study", OF_TODAY)
def test_trials_have_the_stored_bits(study: str, tmp_path: Path) -> None:
    here, trials = copied("0.18.0", tmp_path), TRIALS["0.18.0", study]
    said = done(here, "verify", study, "--fraction", "1").stdout
    assert f"result     {trials} of {trials} bitwise identical" in said


@pytest.mark.parametrize("version", slow_but(["0.13.0"], COMMITS))
def test_own_code_of_then_runs_today(version: str, tmp_path: Path) -> None:
    """As other trials, since the code that it calls is another."""
    here = copied(version, tmp_path)
    assert "own: 4 new trials (4 done)" in launched(here, "own")
    stored = sweep.load("own", here / "studies")
    assert stored.statuses() == {"done": 4}
    assert stored.apart() == 4


@pytest.mark.parametrize("which", REPORTS, ids="-".join)
def test_reports_are_those_of_then(which: tuple[str, str, str], tmp_path: Path) -> None:
    version, study, report = which
    here = copied(version, tmp_path)
    now = done(here, *REPORTS[which], "--json").stdout
    then = STORED / version / "expected" / study / f"{report}.json"
    alike(now, then.read_text(), but=OTHER if report == "search" else WORDS)
