"""Numbers in options: those without sense are refused with what is allowed, before any
work.
"""

from pathlib import Path

import pytest

from sweep.tables.stored_study import StoredStudy
from tests.commands import sweep
from tests.studies import SMALL

SEARCH = """
study: sought
model: nguyen2024
fixed: {n: 5, steps: 2}
search:
  parameters: {separation_weight: {uniform: [0, 2]}}
  objectives: {speed: {maximize: mean}}
  budget: 20
replicates: 2
"""
COUNT = ("-1", "1.5")
EVERY_COUNT = (*COUNT, "nan", "inf", "1e9", "two")
"""These are told from whole numbers in one way for all commands."""
REFUSED: dict[str, tuple[str, ...]] = {
    "launch small.yaml --workers": (*EVERY_COUNT, "1000000000"),
    "verify small --workers": (*COUNT, "1000000000"),
    "measure small speed --workers": (*COUNT, "1000000000"),
    "plan small.yaml --workers": (*COUNT, "1000000000"),
    "search search.yaml --workers": (*COUNT, "1000000000"),
    "reproduce --workers": (*COUNT, "1000000000"),
    "search search.yaml --repetitions": (*COUNT, "0", "1000000000"),
    "launch small.yaml --shard": (*COUNT, "0/0", "0/4", "5/4", "-1/4", "1/1000000000"),
    "verify small --fraction": ("-0.5", "1.5", "nan", "inf", "1e9", "half"),
    "verify small --most": (*COUNT, "0"),
    "verify small --seed": EVERY_COUNT,
    "replay small TRIAL --trajectory new.parquet --every": (*COUNT, "10", "1000000000"),
    "replay small TRIAL --frame": tuple(f"{one} new.png" for one in (*COUNT, "10")),
    "compare small small --margin": ("0", "-1", "nan", "inf", "wide"),
    "compare small small --confidence": ("0", "0.4", "1", "2", "nan", "inf", "-1"),
    "view --no-open --port": (*COUNT, "65536", "1000000000"),
}
"""Commands up to their option, and what each refuses."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a stored study and two specs."""
    folder = tmp_path_factory.mktemp("numbers")
    (folder / "small.yaml").write_text(SMALL)
    (folder / "search.yaml").write_text(SEARCH)
    assert sweep(folder, "launch", "small.yaml").returncode == 0
    return folder


@pytest.mark.parametrize("command", REFUSED)
def test_numbers_without_sense_are_refused(folder: Path, command: str) -> None:
    trial = _trial(folder)
    before = sorted(folder.rglob("*"))
    for number in REFUSED[command]:
        words = f"{command.replace('TRIAL', trial)} {number}".split()
        done = sweep(folder, *words)
        assert (done.returncode, done.stdout) == (2, ""), number
        assert "Traceback" not in done.stderr
    assert sorted(folder.rglob("*")) == before


def _trial(folder: Path) -> str:
    return str(StoredStudy("small", folder / "results").trials["trial_id"].iloc[0])


def test_what_is_allowed_is_said(folder: Path) -> None:
    for words, said in (
        (
            "verify small --fraction nan",
            "fraction: nan; allowed: 0 to 1, such as 0.01",
        ),
        ("launch small.yaml --shard 0/0", "no shard 0/0: shards are 1/1 and higher"),
        (
            "replay small TRIAL --every 10",
            "every: 10; allowed: 0 to 9, the number of steps",
        ),
    ):
        given = words.replace("TRIAL", _trial(folder)).split()
        assert said in " ".join(sweep(folder, *given).stderr.split()), words
