"""A part that lost a file, or a bit of one, is named and set aside, and its trials run
again to the same bits.
"""

import logging
import os
import shutil
from pathlib import Path
from random import Random

import pytest

from sweep.errors import StoreError
from sweep.store.manifest import MANIFEST, damage
from sweep.store.store import Store
from tests.cases import slow_but
from tests.faults.campaign import tables
from tests.studies import OWN_SMALL, SMALL, launched, relaunch


@pytest.fixture(scope="module", params=[SMALL, OWN_SMALL], ids=["ours", "own code"])
def spec(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def whole(spec: str, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a study of two parts: three trials at either of two points."""
    results = tmp_path_factory.mktemp("whole")
    relaunch(spec.replace("[0.5, 1]", "[0.5]"), results)
    relaunch(spec, results)
    folder = results / "small"
    assert len(Store(folder).all_parts()) == 2
    return folder


@pytest.fixture
def folder(whole: Path, tmp_path: Path) -> Path:
    """A copy to damage."""
    shutil.copytree(whole, tmp_path / "small")
    return tmp_path / "small"


def flip(file: Path, offset: int) -> None:
    content = bytearray(file.read_bytes())
    content[offset] ^= 1 << (offset % 8)
    file.write_bytes(content)


NAMES = ["trials.parquet", "series.parquet", MANIFEST]


@pytest.mark.parametrize(
    "spec",
    slow_but([SMALL], [SMALL, OWN_SMALL]),
    ids=["ours", "own code"],
    indirect=True,
)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("what", ["missing", "empty", "truncated", "flipped"])
def test_a_damaged_part_is_set_aside_and_its_trials_run_again(
    folder: Path,
    spec: str,
    whole: Path,
    caplog: pytest.LogCaptureFixture,
    name: str,
    what: str,
) -> None:
    """Without its manifest alone a part is decoded, and found to be sound."""
    part = Store(folder).all_parts()[1]
    file = part / name
    if what == "missing":
        file.unlink()
    elif what == "flipped":
        flip(file, 5 if name == MANIFEST else file.stat().st_size - 30)
    else:
        os.truncate(file, file.stat().st_size // 2 if what == "truncated" else 0)
    before = {each.name: each.stat().st_size for each in part.iterdir()}
    sound = name == MANIFEST and what == "missing"
    with caplog.at_level(logging.WARNING):
        progress = relaunch(spec, folder.parent)
    assert progress.statuses.total() == (0 if sound else 3)
    assert tables(folder) == tables(whole)
    kept = folder / "damaged" / part.name
    assert (
        sound or {each.name: each.stat().st_size for each in kept.iterdir()} == before
    )
    lines = [
        f"{part}: damaged: {name} ",
        f"set aside as {kept}, its 3 trials run again",
    ]
    assert all(line in caplog.text for line in lines) != sound
    assert relaunch(spec, folder.parent).statuses.total() == 0


def test_how_many_trials_are_lost_is_said_to_be_unknown_where_it_is(
    folder: Path, spec: str, caplog: pytest.LogCaptureFixture
) -> None:
    part = Store(folder).all_parts()[0]
    for name in (MANIFEST, "trials.parquet"):
        os.truncate(part / name, 3)
    with caplog.at_level(logging.WARNING):
        relaunch(spec, folder.parent)
    assert "its trials is unknown; all run again" in caplog.text


def test_every_flipped_bit_and_every_cut_is_found(whole: Path, tmp_path: Path) -> None:
    """400 places of all files, drawn from a seed, the footers among them."""
    random, part = Random(3), Store(whole).all_parts()[0]
    assert damage(part) == ""
    for number in range(400):
        copy = tmp_path / str(number)
        shutil.copytree(part, copy)
        file = copy / random.choice([name for name in NAMES if name != MANIFEST])
        offset = random.randrange(file.stat().st_size)
        if number % 2:
            flip(file, offset)
        else:
            os.truncate(file, offset)
        assert damage(copy).startswith(file.name)


@pytest.mark.parametrize("what", ["truncated", "missing", "flipped", "series"])
def test_a_part_without_a_manifest_is_decoded(folder: Path, what: str) -> None:
    """As those of version 0.2.0 are."""
    part = Store(folder).all_parts()[0]
    (part / MANIFEST).unlink()
    assert damage(part) == ""
    if what == "truncated":
        os.truncate(part / "series.parquet", 300)
        assert damage(part) == "series.parquet cannot be read"
    elif what == "series":
        (part / "series.parquet").unlink()
        assert damage(part) == "series.parquet is missing"
    elif what == "missing":
        (part / "trials.parquet").unlink()
        assert damage(part) == "trials.parquet cannot be read"
    else:
        flip(part / "series.parquet", 60)
        assert damage(part) == "series.parquet cannot be read"


def test_reading_names_the_remedy_and_moves_nothing(folder: Path) -> None:
    part = Store(folder).all_parts()[0]
    os.truncate(part / "trials.parquet", 100)
    with pytest.raises(
        StoreError,
        match=(
            rf"{part}/trials.parquet: cannot be read .*; launch the study again, to"
        ),
    ):
        Store(folder).read("trials")
    assert part.exists()
    assert not (folder / "damaged").exists()


def test_a_merged_part_that_is_damaged_gives_way_to_those_it_replaced(
    folder: Path, spec: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed before they were deleted, they are all there."""
    monkeypatch.setattr(Store, "discard", lambda *_: None)
    old = set(Store(folder).all_parts())
    relaunch(spec.replace("seed: 5", "seed: 6"), folder.parent)
    relaunch(spec, folder.parent)
    store = Store(folder)
    store.merge(sorted(old), {})
    [merged] = (
        set(store.current_parts())
        - old
        - {part for part in store.all_parts() if "+" not in part.name}
    )
    for name in ("replaces.json", "trials.parquet"):
        os.truncate(merged / name, 10)
    monkeypatch.undo()
    assert relaunch(spec, folder.parent).statuses.total() == 0
    assert (folder / "damaged" / merged.name).exists()
    assert launched(spec, folder.parent).trials["trial_id"].is_unique


def test_a_link_is_no_place_for_damaged_parts(
    folder: Path, spec: str, tmp_path: Path
) -> None:
    (tmp_path / "elsewhere").mkdir()
    (folder / "damaged").symlink_to(tmp_path / "elsewhere")
    os.truncate(Store(folder).all_parts()[0] / "trials.parquet", 10)
    with pytest.raises(StoreError, match="is a symbolic link"):
        relaunch(spec, folder.parent)
    assert list((tmp_path / "elsewhere").iterdir()) == []
