"""A packed study comes from anyone: all of its file is checked before anything is made
of it.
"""

import hashlib
import json
import os
import shutil
import stat
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import pytest

from sweep.errors import UserError
from sweep.sharing.packed_file import PackedFile
from sweep.sharing.packing import pack
from sweep.sharing.unpacking import unpack
from sweep.tables.stored_study import StoredStudy
from tests.attacks.test_own_code import SPEC, Given, stranger
from tests.commands import sweep
from tests.studies import SMALL, launched

__all__ = ["stranger"]
Members = dict[str, bytes]
BEGINNING = (1980, 1, 1, 0, 0, 0)


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """An honest file."""
    folder = tmp_path_factory.mktemp("honest")
    study = launched(SMALL, folder / "results")
    return pack(study, folder / "x.zip").path.read_bytes()


@pytest.fixture
def given(tmp_path: Path) -> Given:
    return Given(tmp_path)


def members(packed: bytes) -> Members:
    with ZipFile(BytesIO(packed)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def summed(found: Members) -> Members:
    """The same with honest checksums."""
    sums = {name: hashlib.sha256(one).hexdigest() for name, one in found.items()}
    sums.pop("SHA256SUMS", None)
    lines = [f"{digest}  {name}\n" for name, digest in sums.items()]
    return found | {"SHA256SUMS": "".join(lines).encode()}


def written(
    path: Path,
    found: Members,
    change: Callable[[ZipInfo], object] = lambda _info: None,
    method: int = ZIP_STORED,
) -> Path:
    with ZipFile(path, "w", method) as archive:
        for name, content in found.items():
            info = ZipInfo("x", BEGINNING)
            info.filename, info.compress_type = name, method
            info.create_system = 3
            change(info)
            archive.writestr(info, content)
    return path


def refused(path: Path, folder: Path) -> str:
    """What is said of a file that is refused, in a line, with nothing written."""
    (folder / "results").mkdir(exist_ok=True)
    before = sorted(folder.rglob("*"))
    with pytest.raises(UserError) as error:
        unpack(path, folder / "results")
    assert sorted(folder.rglob("*")) == before
    assert not (folder.parent / "evil").exists()
    said = str(error.value)
    assert len(said.splitlines()) == 1
    return said


@pytest.mark.parametrize(
    "name",
    [
        "../evil",
        "study/../../evil",
        "study/parts/../../../evil",
        "/tmp/boidsweep-evil",
        "study//spec.yaml",
        "study\\..\\..\\evil",
        "C:evil",
        "./evil",
        "evil\n",
        "study/parts/x/../evil.json",
        "study/",
        "x" * 600,
    ],
)
def test_no_path_leads_out_of_the_file(
    name: str, packed: bytes, tmp_path: Path
) -> None:
    path = written(tmp_path / "x.zip", summed(members(packed) | {name: b"evil"}))
    said = refused(path, tmp_path)
    assert "nothing was written" in said
    assert not Path("/tmp/boidsweep-evil").exists()


@pytest.mark.parametrize(
    "name",
    [
        "study/lock/0.json",
        "study/checkpoints/x.state",
        "study/writing/x",
        "study/parts/x/trials.parquet",
        "study/figures/figures.py",
        "study/code.py",
    ],
)
def test_only_what_a_launch_stores_is_loaded(
    name: str, packed: bytes, tmp_path: Path
) -> None:
    path = written(tmp_path / "x.zip", summed(members(packed) | {name: b"evil"}))
    assert "is not a file of a study" in refused(path, tmp_path)


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_links_and_special_files_are_refused(
    kind: int, packed: bytes, tmp_path: Path
) -> None:
    def change(info: ZipInfo) -> None:
        if info.filename == "study/spec.yaml":
            info.external_attr = (kind | 0o777) << 16

    found = summed(members(packed) | {"study/spec.yaml": b"/etc/passwd"})
    said = refused(written(tmp_path / "x.zip", found, change), tmp_path)
    assert "study/spec.yaml is a link or another special file" in said


def test_nothing_unpacks_to_more_than_it_is(packed: bytes, tmp_path: Path) -> None:
    """A bomb is refused before a byte of it is unpacked."""
    bomb = summed(members(packed) | {"study/spec.yaml": bytes(50_000_000)})
    path = written(tmp_path / "x.zip", bomb, method=ZIP_DEFLATED)
    assert path.stat().st_size < 500_000
    assert "is compressed" in refused(path, tmp_path)
    written(tmp_path / "x.zip", members(packed))
    with ZipFile(tmp_path / "x.zip", "a") as archive:
        large = archive.getinfo("study/plan.parquet")
        for number in range(20):  # the same bytes under many names
            again = ZipInfo(f"more-{number}", BEGINNING)
            for field in ("header_offset", "file_size", "compress_size", "CRC"):
                setattr(again, field, getattr(large, field))
            archive.filelist.append(again)
        archive._didModify = True  # type: ignore[attr-defined]
    assert "unpacks to" in refused(tmp_path / "x.zip", tmp_path)


def test_a_long_list_of_checksums_is_not_read(
    packed: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweep.sharing.packed_file.MOST_SUMS", 100)
    path = written(tmp_path / "x.zip", members(packed))
    assert "SHA256SUMS is larger than 100 bytes" in refused(path, tmp_path)


@pytest.mark.parametrize(
    "name", ["README.md", "tables/trials.csv", "study/plan.parquet", "CITATION.bib"]
)
def test_a_member_that_was_changed_is_refused(
    name: str, packed: bytes, tmp_path: Path
) -> None:
    found = members(packed)
    found[name] = found[name][:-1] + b"!"
    said = refused(written(tmp_path / "x.zip", found), tmp_path)
    assert f"{name} has changed since the packing: the sha256 differs" in said


def test_a_file_that_lost_or_changed_bytes_is_refused(
    packed: bytes, tmp_path: Path
) -> None:
    """Or what was changed is none of its content, as the time of a member."""
    known = members(packed)
    path = tmp_path / "x.zip"
    for length in (0, 1, 30, 1000, len(packed) // 2, len(packed) - 1):
        path.write_bytes(packed[:length])
        assert refused(path, tmp_path)
    whole = 0
    for place in range(0, len(packed), len(packed) // 60):
        changed = bytearray(packed)
        changed[place] ^= 0x55
        path.write_bytes(changed)
        try:
            unpack(path, tmp_path / "results")
        except UserError:
            continue
        assert members(path.read_bytes()) == known
        shutil.rmtree(tmp_path / "results")
        whole += 1
    assert whole < 5


@pytest.mark.parametrize("change", [0x01, 0x08, 0x55, 0x80])
def test_a_changed_list_of_members_is_refused_or_none_of_the_content(
    packed: bytes, tmp_path: Path, change: int
) -> None:
    """Places of it lead elsewhere, also to before the file."""
    known, path = members(packed), tmp_path / "x.zip"
    for place in range(len(packed) - 500, len(packed)):
        changed = bytearray(packed)
        changed[place] ^= change
        path.write_bytes(changed)
        try:
            with PackedFile(path) as found:
                names = {*found.names()}
        except UserError:
            continue
        assert names == {
            name.removeprefix("study/") for name in known if name.startswith("study/")
        }


def test_all_members_are_listed_once(packed: bytes, tmp_path: Path) -> None:
    found, path = members(packed), tmp_path / "x.zip"
    written(path, found | {"more.txt": b"more"})
    assert "more.txt has no checksum" in refused(path, tmp_path)
    written(path, {name: one for name, one in found.items() if name != "README.md"})
    assert "README.md is only in SHA256SUMS" in refused(path, tmp_path)
    written(path, found | {"SHA256SUMS": b"nothing\n"})
    assert "SHA256SUMS is not a list of checksums" in refused(path, tmp_path)
    written(path, {name: one for name, one in found.items() if name != "SHA256SUMS"})
    assert "SHA256SUMS is missing" in refused(path, tmp_path)
    written(path, found)
    with pytest.warns(UserWarning, match="Duplicate"), ZipFile(path, "a") as archive:
        archive.writestr("README.md", "other")
    assert "README.md is a member twice" in refused(path, tmp_path)


@pytest.mark.parametrize(
    "name", ["../evil", "plan.parquet", "a/../../evil", "", "x" * 300, 3, None]
)
def test_a_name_that_no_study_has_is_refused(
    name: object, packed: bytes, tmp_path: Path
) -> None:
    found = members(packed)
    crate = json.loads(found["ro-crate-metadata.json"])
    crate["@graph"][1]["name"] = name
    if name is None:
        del crate["@graph"][1]["name"]
    found["ro-crate-metadata.json"] = json.dumps(crate).encode()
    path = written(tmp_path / "x.zip", summed(found))
    assert refused(path, tmp_path)


@pytest.mark.parametrize(
    "lost", ["study/plan.parquet", "manifest.json", "trials.parquet", "series.parquet"]
)
def test_what_no_launch_writes_is_refused_though_its_checksums_are_right(
    lost: str, packed: bytes, tmp_path: Path
) -> None:
    found = members(packed)
    name = next(name for name in found if name.endswith(lost))
    written(tmp_path / "x.zip", summed(found | {name: b"no parquet, no JSON"}))
    said = refused(tmp_path / "x.zip", tmp_path)
    assert "has a study that no launch writes" in said
    assert "writing/" not in said
    left = {key: one for key, one in found.items() if key != name}
    written(tmp_path / "x.zip", summed(left))
    if lost != "manifest.json":  # up to 0.2.0 there was none
        assert "has a study that no launch" in refused(tmp_path / "x.zip", tmp_path)


def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.zip")
    assert "not an ordinary file" in refused(tmp_path / "x.zip", tmp_path)


def test_a_link_in_the_results_is_not_followed(packed: bytes, tmp_path: Path) -> None:
    (tmp_path / "x.zip").write_bytes(packed)
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "small").symlink_to(tmp_path / "elsewhere")
    assert "is a symbolic link" in refused(tmp_path / "x.zip", tmp_path)


def test_code_of_a_loaded_study_runs_only_with_trust(stranger: Given) -> None:
    """Neither packing nor loading runs it, nor do tables."""
    folder = stranger.folder
    (folder / "results" / "given" / "notes").touch()
    assert sweep(folder, "pack", "given").returncode == 0
    loaded = sweep(folder, "load", "given.zip", "--as", "theirs")
    assert "runs only with --trust" in loaded.stderr
    for command in ("table", "status", "code", "cite", "odd"):
        assert sweep(folder, command, "theirs").returncode == 0
    assert sweep(folder, "verify", "theirs").returncode == 2
    assert stranger.ran() == 0
    assert StoredStudy("theirs", folder / "results").spec == SPEC
    done = sweep(folder, "verify", "theirs", "--trust", "--fraction", "1")
    assert "4 of 4 bitwise identical" in done.stdout
    assert stranger.ran() == 1
