"""Compiled kernels are pickles, and read from no folder that others can write."""

import errno
import logging
import os
import pickle
import subprocess
import sys
import tempfile
from collections import namedtuple
from collections.abc import Iterator
from pathlib import Path

import pytest

from kernels.caching import FOLDER, usual_folder
from sweep.errors import CacheError
from sweep.trial import compiled
from sweep.trial.compiled import make_private, settle, usual
from tests.patience import PATIENCE

ONE_KERNEL = """
from pathlib import Path
from sweep.trial import compiled

way, ours = compiled._way, Path(__file__).parent
compiled._way = lambda folder: (one for one in way(folder) if one.is_relative_to(ours))
from kernels.arbitration import limit

print(limit(6.0, 8.0, 5.0))
"""
"""Folders above that of the test may be anybody's."""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of ours, above which nothing is looked at: it may be anybody's."""
    way = compiled._way

    def ours(folder: Path) -> Iterator[Path]:
        return (place for place in way(folder) if place.is_relative_to(tmp_path))

    monkeypatch.setattr(compiled, "_way", ours)
    monkeypatch.setattr(compiled, "_is_private", lambda _group: False)
    folder = tmp_path / "cache"
    folder.mkdir()
    folder.chmod(0o755)
    return folder


def mode(place: Path) -> int:
    return place.stat().st_mode & 0o7777


def filled(cache: Path) -> Path:
    """A folder as numba leaves it there, with the modes of a usual umask."""
    folder = cache / "boidsweep"
    (folder / "stamp").mkdir(parents=True)
    (folder / "stamp" / "limit.nbi").touch()
    for place in (folder, *folder.rglob("*")):
        place.chmod(0o755)
    return folder


@pytest.mark.parametrize("umask", [0, 0o002, 0o022, 0o077])
def test_what_is_made_is_private_with_any_umask(cache: Path, umask: int) -> None:
    folder, before = cache / "a" / "boidsweep", os.umask(umask)
    try:
        make_private(folder)
    finally:
        os.umask(before)
    assert [mode(folder.parent), mode(folder)] == [0o700, 0o700]


def test_what_only_the_user_could_write_is_used_and_closed(cache: Path) -> None:
    folder = filled(cache)
    make_private(folder)
    assert (mode(folder), mode(folder / "stamp")) == (0o700, 0o755)
    make_private(folder)


def test_the_kernels_of_this_process_are_private() -> None:
    assert mode(FOLDER.parent) == 0o700


@pytest.mark.parametrize("place", [".", "boidsweep", "boidsweep/stamp"])
@pytest.mark.parametrize("bits", [0o777, 0o775, 0o757, 0o702])
def test_a_folder_that_others_can_write_is_refused(
    cache: Path,
    place: str,
    bits: int,
) -> None:
    folder = filled(cache)
    (cache / place).chmod(bits)
    with pytest.raises(CacheError) as refusal:
        make_private(folder)
    words = f"{cache / place} can be written by other users (mode {bits:o}), so"
    assert str(refusal.value) == (
        f"{words} {folder} may hold code of other users: remove it"
    )


def test_a_file_that_others_can_write_is_refused(cache: Path) -> None:
    folder = filled(cache)
    (folder / "stamp" / "limit.nbi").chmod(0o666)
    with pytest.raises(CacheError, match=r"limit.nbi can be written by other users"):
        make_private(folder)


def test_a_sticky_folder_will_do_on_the_way_and_nowhere_else(cache: Path) -> None:
    folder = filled(cache)
    cache.chmod(0o1777)
    make_private(folder)
    folder.chmod(0o1777)
    with pytest.raises(CacheError, match=r"boidsweep can be written by other users"):
        make_private(folder)


@pytest.mark.parametrize("place", [".", "boidsweep", "boidsweep/stamp/limit.nbi"])
def test_what_belongs_to_another_user_is_refused(
    cache: Path,
    place: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    folder, theirs, lstat = filled(cache), cache / place, Path.lstat

    def foreign(path: Path) -> os.stat_result:
        mode, inode, device, links, uid, *others = lstat(path)
        owner = 4242 if path == theirs else uid
        return os.stat_result((mode, inode, device, links, owner, *others))

    monkeypatch.setattr(Path, "lstat", foreign)
    with pytest.raises(CacheError, match=f"{theirs} belongs to user 4242, so"):
        make_private(folder)


Group = namedtuple("Group", "gr_name gr_mem")
User = namedtuple("User", "pw_name")


@pytest.mark.parametrize(
    ("group", "private"),
    [
        (Group("me", []), True),
        (Group("me", ["me"]), True),
        (Group("me", ["me", "you"]), False),
        (Group("users", []), False),
    ],
)
def test_a_group_may_write_that_is_the_users_alone(
    tmp_path: Path,
    group: Group,
    private: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("grp.getgrgid", lambda _number: group)
    monkeypatch.setattr("pwd.getpwuid", lambda _number: User("me"))
    tmp_path.chmod(0o775)
    if private:
        compiled._check(tmp_path)
    else:
        words = r"can be written by other users \(mode 775\)"
        with pytest.raises(CacheError, match=words):
            compiled._check(tmp_path)


def test_a_group_without_a_user_is_not_private(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(_number: int) -> None:
        raise KeyError

    monkeypatch.setattr("pwd.getpwuid", unknown)
    assert not compiled._is_private(0)


def test_links_are_followed_and_what_they_lead_to_is_seen(cache: Path) -> None:
    (cache / "elsewhere").mkdir(0o755)
    (cache / "link").symlink_to("elsewhere/new")
    make_private(cache / "link" / "boidsweep")
    assert mode(cache / "elsewhere" / "new" / "boidsweep") == 0o700
    (cache / "elsewhere").chmod(0o777)
    with pytest.raises(CacheError, match=r"elsewhere can be written by other users"):
        make_private(cache / "link" / "boidsweep")


def test_a_link_that_others_can_turn_is_refused(cache: Path) -> None:
    (cache / "open").mkdir()
    (cache / "open" / "link").symlink_to(cache)
    (cache / "open").chmod(0o777)
    (cache / "first").symlink_to(cache / "open" / "link")
    with pytest.raises(CacheError, match=r"open can be written by other users"):
        make_private(cache / "first" / "boidsweep")


def test_a_link_within_is_refused(cache: Path) -> None:
    folder = filled(cache)
    (folder / "stamp" / "more.nbi").symlink_to("/etc/passwd")
    with pytest.raises(CacheError, match=r"more.nbi can be written by other users"):
        make_private(folder)


def test_where_nothing_can_be_made_or_written_is_said(
    cache: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (cache / "file").touch(0o600)
    with pytest.raises(CacheError, match=r"cannot be used \(.*Not a directory"):
        make_private(cache / "file" / "boidsweep")
    (cache / "loop").symlink_to("loop")
    with pytest.raises(CacheError, match=r"boidsweep cannot be used \("):
        make_private(cache / "loop" / "boidsweep")

    def full(**_options: object) -> None:
        raise OSError(errno.EDQUOT, "Disk quota exceeded")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(CacheError, match=r"cannot be used \(.*quota exceeded"):
        make_private(cache / "boidsweep")


@pytest.mark.parametrize(
    "variables",
    [
        {"HOME": "/h"},
        {"HOME": "/h", "XDG_CACHE_HOME": "/x"},
        {"HOME": "/h", "XDG_CACHE_HOME": "/x", "NUMBA_CACHE_DIR": "/n"},
        {"HOME": "/h", "XDG_CACHE_HOME": "", "NUMBA_CACHE_DIR": ""},
    ],
)
def test_the_folder_is_the_one_that_kernels_take(
    variables: dict[str, str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert usual() == usual_folder().parent


def test_a_relative_folder_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "cache")
    with pytest.raises(CacheError, match="cache is relative to the current folder"):
        usual()


def test_a_temporary_folder_takes_its_place_and_is_told_once(
    cache: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """A worker process finds the temporary folder in its environment, and is silent."""
    cache.chmod(0o777)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(cache))
    monkeypatch.setattr(tempfile, "tempdir", str(cache.parent))
    with caplog.at_level(logging.WARNING, "sweep"):
        settle()
        place = Path(os.environ["NUMBA_CACHE_DIR"])
        settle()
    (line,) = caplog.messages
    assert line.startswith("compiled kernels are stored for this process only: ")
    assert line.endswith(" Set NUMBA_CACHE_DIR to a folder that you alone can write.")
    assert f"{cache} can be written by other users (mode 777)" in line
    assert place.parent == cache.parent
    assert (mode(place), mode(place / "boidsweep")) == (0o700, 0o700)
    assert os.environ["NUMBA_CACHE_DIR"] == str(place)
    assert list(cache.iterdir()) == []


Done = subprocess.CompletedProcess[str]


def ran(folder: Path, code: str, **environment: str) -> Done:
    """A script that has run with more in its environment."""
    script = folder / "script.py"
    script.write_text(code)
    script.chmod(0o644)
    return subprocess.run(
        [sys.executable, str(script)],
        env=os.environ | environment,
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )


class Payload:
    """Unpickling it makes a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = str(folder)

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (self.folder,)


@pytest.mark.slow
def test_a_pickle_that_others_may_have_put_there_is_not_loaded(tmp_path: Path) -> None:
    """It would be, were the folder not open to others: the last run shows that."""
    cache, trap = tmp_path / "cache", tmp_path / "trap"
    places = {"NUMBA_CACHE_DIR": str(cache), "TMPDIR": str(tmp_path)}
    first = ran(tmp_path, ONE_KERNEL, **places)
    assert first.stdout == "(3.0, 4.0)\n", first.stderr
    indices = list(cache.glob("boidsweep/kernels/*.nbi"))
    for index in indices:
        index.write_bytes(pickle.dumps(Payload(trap)))
    assert indices
    cache.chmod(0o777)
    attacked = ran(tmp_path, ONE_KERNEL, **places)
    assert attacked.stdout == "(3.0, 4.0)\n", attacked.stderr
    assert f"{cache} can be written by other users (mode 777)" in attacked.stderr
    assert not trap.exists()
    cache.chmod(0o755)
    ran(tmp_path, ONE_KERNEL, **places)
    assert trap.exists()


def homeless(folder: Path) -> dict[str, str]:
    """An environment in which the home folder is a file."""
    home = str(folder / "script.py")
    return {"HOME": home, "XDG_CACHE_HOME": "", "NUMBA_CACHE_DIR": ""}


SHARED = """
import sweep
from kernels.caching import FOLDER
from sweep.workers.executors import Loky
from shared import cache

engine = Loky(2)
pool = engine.start()
workers = {pool.submit(cache).result() for _ in range(4)}
print(*workers, *({str(FOLDER)} - workers))
engine.stop()
"""
CACHE = """
import sweep
from kernels.caching import FOLDER

def cache():
    return str(FOLDER)
"""


def test_workers_share_the_temporary_folder_and_it_goes(tmp_path: Path) -> None:
    (tmp_path / "shared.py").write_text(CACHE)
    (tmp_path / "tmp").mkdir(0o700)
    done = ran(tmp_path, SHARED, TMPDIR=str(tmp_path / "tmp"), **homeless(tmp_path))
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.strip()).is_relative_to(tmp_path / "tmp"), done.stdout
    assert done.stderr.count("compiled kernels are stored for this process only") == 1
    assert "script.py/.cache/boidsweep cannot be used" in done.stderr
    assert list((tmp_path / "tmp").iterdir()) == []


NOWHERE = """
import sys, tempfile
from sweep.cli import main

tempfile.tempdir = sys.argv[0]
sys.argv = ["sweep", "models"]
main()
"""


def test_without_any_folder_a_command_ends_in_one_line(tmp_path: Path) -> None:
    done = ran(tmp_path, NOWHERE, **homeless(tmp_path))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("no folder can store compiled kernels: ")
    assert "Set NUMBA_CACHE_DIR to a folder that you alone can write." in done.stderr
