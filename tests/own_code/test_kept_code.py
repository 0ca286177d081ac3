"""The code that is kept with a study: damage is named and mended, what computed nothing
that stays can go, and nothing else does.
"""

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from sweep.errors import StoreError
from sweep.store.lock import Lock
from sweep.store.shares import Share
from sweep.tables.cleaning import clean, find_waste
from sweep.tables.stored_study import StoredStudy
from tests.cases import slow_but
from tests.commands import sweep
from tests.own_models import (
    OTHER_METRIC,
    OTHER_RULE,
    OTHER_WORDS,
    edited,
    written,
)
from tests.studies import launched, relaunch


def cut(file: Path) -> None:
    os.truncate(file, 100)


def empty(file: Path) -> None:
    os.truncate(file, 0)


def forge(file: Path) -> None:
    file.write_bytes(file.read_bytes().replace(b"SIGN = 1.0", b"SIGN = 2.0"))


def misdescribe(file: Path) -> None:
    stored = json.loads(file.read_bytes())
    file.write_text(json.dumps(stored | {"about": {"models": []}}))


def enlarge(file: Path) -> None:
    with file.open("ab") as more:
        more.write(b" and more")


def link(file: Path) -> None:
    file.rename(file.with_name("elsewhere"))
    file.symlink_to("elsewhere")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a spec, its files, and the study as launched."""
    launched(written(tmp_path), tmp_path / "results")
    return tmp_path


def kept(folder: Path) -> list[Path]:
    return sorted((folder / "results" / "drawn").glob("code-*.json"))


@pytest.mark.parametrize(
    "damage",
    slow_but(
        [forge, link, Path.unlink],
        [cut, empty, forge, misdescribe, enlarge, link, Path.unlink],
    ),
)
def test_damaged_code_is_one_sentence_and_the_next_launch_mends_it(
    folder: Path, damage: Callable[[Path], None]
) -> None:
    before = sweep(folder, "table", "drawn").stdout
    [file] = kept(folder)
    whole = file.read_bytes()
    damage(file)
    for command in (["table", "drawn"], ["verify", "drawn"], ["code", "drawn"]):
        found = sweep(folder, *command)
        assert found.returncode == 2
        [line] = found.stderr.splitlines()
        assert file.name in line
        assert "launch the study again" in line
    done = sweep(folder, "launch", "drawn.yaml")
    assert "nothing was missing" in done.stderr
    assert file.read_bytes() == whole
    assert not file.is_symlink()
    assert sweep(folder, "table", "drawn").stdout == before


@pytest.mark.slow
def test_code_of_earlier_trials_that_is_damaged_harms_no_other(folder: Path) -> None:
    [old] = kept(folder)
    earlier = StoredStudy("drawn", folder / "results").plan["trial_id"][0].as_py()
    edited(folder, *OTHER_RULE)
    relaunch(folder / "drawn.yaml", folder / "results")
    cut(old)
    assert sweep(folder, "table", "drawn").returncode == 0
    verified = sweep(folder, "verify", "drawn", "--fraction=1").stdout
    assert "6 of 6 bitwise identical" in verified
    found = sweep(folder, "replay", "drawn", earlier)
    assert (found.returncode, old.name in found.stderr) == (2, True)


def test_gc_takes_code_with_the_last_trials_that_it_computed(folder: Path) -> None:
    """The three versions: of the first stay no trials, of the second some, though the
    plan is of the third, whose words alone are others.
    """
    spec, results = folder / "drawn.yaml", folder / "results"
    [first] = kept(folder)
    edited(folder, *OTHER_RULE)
    relaunch(spec, results)
    [second] = set(kept(folder)) - {first}
    for old, new in OTHER_WORDS:
        edited(folder, old, new)
    relaunch(spec, results)
    [third] = set(kept(folder)) - {first, second}
    before = StoredStudy("drawn", results)
    rows = before.trials
    waste = find_waste(before)
    assert list(waste.code) == [first.stem.removeprefix("code-")]
    shown = sweep(folder, "gc", "drawn", "--dry-run").stdout
    assert "6 trials that were computed by other code: model drawn as_run" in shown
    assert (
        "go         1 versions of custom code, code-*.json, that computed no remaining"
        f" trial: {first.stat().st_size / 1000:.1f} kB"
    ) in shown
    assert set(kept(folder)) == {first, second, third}
    assert "freed" in sweep(folder, "gc", "drawn", "--yes").stdout
    assert set(kept(folder)) == {second, third}
    after = StoredStudy("drawn", results)
    assert after.trials.equals(rows)
    verified = sweep(folder, "verify", "drawn", "--fraction=1").stdout
    assert "6 of 6 bitwise identical" in verified
    assert find_waste(after).code == {}


def test_code_that_computed_nothing_goes_alone_and_only_after_a_yes(
    folder: Path,
) -> None:
    """As of a launch that was killed before it had stored its plan."""
    [used] = kept(folder)
    left = used.with_name(f"code-{'a' * 64}.json")
    shutil.copy(used, left)
    study = StoredStudy("drawn", folder / "results")
    assert "nothing; small parts" not in find_waste(study).as_text(study)
    refused = sweep(folder, "gc", "drawn")
    assert refused.returncode == 2
    assert "nothing was removed" in refused.stderr
    assert set(kept(folder)) == {used, left}
    size = left.stat().st_size
    assert clean(study, find_waste(study)) == size
    assert kept(folder) == [used]
    assert "go         nothing" in sweep(folder, "gc", "drawn", "--dry-run").stdout


def test_code_that_a_launch_of_a_share_has_written_stays(folder: Path) -> None:
    """It comes before the plan and the parts that name it. While the share is in work,
    nothing goes; afterwards it has trials.
    """
    spec, results = folder / "drawn.yaml", folder / "results"
    edited(folder, *OTHER_RULE)
    study = StoredStudy("drawn", results)
    [old] = kept(folder)
    new = old.with_name(f"code-{'a' * 64}.json")
    shutil.copy(old, new)
    waste = find_waste(study)
    assert len(waste.code) == 1
    with (
        Lock(study.store.place, Share(1, 3)),
        pytest.raises(StoreError, match="shard 1/3 of this study is being launched"),
    ):
        clean(study, waste)
    assert set(kept(folder)) == {old, new}
    relaunch(spec, results)
    with pytest.raises(StoreError, match="was launched meanwhile"):
        clean(study, waste)
    assert new in kept(folder)


@pytest.mark.slow
def test_code_that_was_named_since_it_was_looked_at_stays(folder: Path) -> None:
    """The same plan, and a part that another launch has stored meanwhile."""
    results = folder / "results"
    [old], first = kept(folder), StoredStudy("drawn", results)
    trials = first.plan["trial_id"].combine_chunks()
    rows = first.store.read("trials", trial_ids=trials)
    edited(folder, *OTHER_METRIC)
    relaunch(folder / "drawn.yaml", results)
    study = StoredStudy("drawn", results)
    for part in study.store.current_parts():
        study.store.discard(part)
    waste = find_waste(study)
    assert list(waste.code) == [old.stem.removeprefix("code-")]
    study.store.append({"trials": rows})
    clean(study, waste)
    assert set(study.store.trial_ids()) == set(trials.to_pylist())
    assert old in kept(folder)
