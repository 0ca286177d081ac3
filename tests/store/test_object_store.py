"""Results in an object store: a real server, real requests, and a crash between any two
of them.
"""

import logging
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pyarrow as pa
import pytest

from sweep.campaigns.measuring import measure
from sweep.errors import StoreError, UnreachableError
from sweep.methods.search.asked_trials import read_asked
from sweep.store import buckets, locations
from sweep.store import lock as lock_module
from sweep.store import store as store_module
from sweep.store.held_store import custody, set_aside_damaged
from sweep.store.locations import ObjectPath, ObjectServer, location
from sweep.store.lock import Lock
from sweep.store.manifest import MANIFEST
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests import ROOT
from tests.cases import slow_but
from tests.commands import run_trials_here
from tests.commands import sweep as command
from tests.faults import campaign
from tests.faults.campaign import tables
from tests.lines import Line
from tests.object_stores import Crashed, Memory, ObjectStore, object_store
from tests.patience import PATIENCE
from tests.store.test_store import append, sorted_tables
from tests.studies import SMALL, launched, relaunch, same

SPEC = campaign.SPEC.replace("replicates: 30", "replicates: 12")


@pytest.fixture(scope="module")
def server() -> Iterator[ObjectStore]:
    with object_store() as started:
        yield started


@pytest.fixture
def bucket(server: ObjectStore, request: pytest.FixtureRequest) -> str:
    """The place of results in a bucket of this test's own."""
    return server.url(f"bucket-{abs(hash(request.node.name))}")


@pytest.fixture
def results(bucket: str) -> ObjectPath:
    place = location(bucket)
    assert isinstance(place, ObjectPath)
    return place


@pytest.fixture
def store(results: ObjectPath) -> Store:
    return Store(results / "study")


def keys(results: ObjectPath) -> list[str]:
    """All objects."""
    return sorted(results.listed().objects or ())


@pytest.mark.slow
def test_a_killed_launch_goes_on_to_the_tables_of_a_folder(
    tmp_path: Path, bucket: str, results: ObjectPath
) -> None:
    """The command as a user starts it, killed as soon as a part is there."""
    (tmp_path / "spec.yaml").write_text(SPEC)
    folder = results / "faulty"
    command = [*campaign.LAUNCH, "--results", bucket]
    process = subprocess.Popen(
        command, cwd=tmp_path, stderr=subprocess.PIPE, start_new_session=True
    )
    deadline = time.monotonic() + PATIENCE
    while process.poll() is None and not Store(folder).all_parts():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    process.kill()
    process.communicate()
    assert [key for key in keys(results) if "/lock/" in key] or process.returncode == 0
    first = len(Store(folder).trial_ids())
    assert first > 0
    progress = relaunch(SPEC, results)
    assert progress.statuses.total() == 48 - first
    launched(SPEC, tmp_path)
    assert tables(folder) == tables(tmp_path / "faulty")
    assert not [
        key for key in keys(results) if "/lock/" in key and key.endswith(".json")
    ]


def test_a_command_launches_into_an_object_store_and_reads_it(
    tmp_path: Path, bucket: str
) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL)
    said = []
    for place in (str(tmp_path / "results"), bucket):
        done = command(tmp_path, "launch", "spec.yaml", "--results", place)
        assert (done.returncode, "6 done" in done.stderr) == (0, True)
        table = command(tmp_path, "table", "small", "--csv", "--results", place)
        said.append(table.stdout)
    assert said[0] == said[1] != ""
    status = command(tmp_path, "status", "small", "--results", bucket)
    assert "folder    s3://bucket-" in status.stdout
    assert "done      6" in status.stdout


@pytest.mark.slow
def test_commands_say_of_an_object_store_what_they_say_of_a_folder(
    tmp_path: Path, bucket: str, results: ObjectPath
) -> None:
    for place in (str(tmp_path / "results"), bucket):
        (tmp_path / "spec.yaml").write_text(SMALL)
        assert (
            command(tmp_path, "launch", "spec.yaml", "--results", place).returncode == 0
        )
    trial = StoredStudy("small", results).plan["trial_id"][0].as_py()
    for arguments in (
        ["table", "small", "--csv"],
        [
            "compare",
            "small:separation_weight=0.5",
            "small:separation_weight=1",
            "--csv",
        ],
        ["diff", "spec.yaml"],
        ["replay", "small", trial],
        ["gc", "small", "--dry-run"],
    ):
        said = [
            command(tmp_path, *arguments, "--results", place)
            for place in (str(tmp_path / "results"), bucket)
        ]
        assert said[0].stdout == said[1].stdout
        assert [one.returncode for one in said] == [0, 0]
    status = command(tmp_path, "status", "small", "--results", bucket)
    assert "folder    s3://bucket-" in status.stdout
    assert "done      6" in status.stdout
    freed = command(tmp_path, "gc", "small", "--yes", "--results", bucket)
    assert freed.returncode == 0
    drawn = command(tmp_path, "plot", "small", "curves", "--results", bucket)
    assert drawn.stdout == "figures/small/curves.png\n"
    assert (tmp_path / "figures" / "small" / "curves.png").exists()
    page = command(
        tmp_path,
        "reproduce",
        "--results",
        bucket,
        str(ROOT / "experiments"),
    )
    assert page.returncode == 2
    assert (
        "the page and its figures are written to a folder on this machine"
        in page.stderr
    )


@pytest.mark.slow
def test_metrics_are_measured_in_an_object_store(
    tmp_path: Path, results: ObjectPath
) -> None:
    kept = "record: {series: [speed], every: 2}"
    spec = SMALL.replace(kept, "record: {metrics: [speed], trajectories: true}")
    launched(spec, results)
    assert measure("small", ["polarization"], results, Serial()).measured == 6
    further = spec.replace("[speed]", "[speed, polarization]")
    assert relaunch(further, results).missing == 0
    assert same(StoredStudy("small", results), launched(further, tmp_path))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            "s3://nowhere/x?endpoint_override=127.0.0.1:{port}&scheme=http",
            "s3://nowhere: there is no such bucket",
        ),
        (
            "s3://x/y?endpoint_override=127.0.0.1:{free}&scheme=http",
            "does not answer (Could not connect to server",
        ),
        ("s4://x/y", 'unknown kind of storage "s4://"; did you mean "s3://"?'),
        (
            "s3://x/y?endpoint=here",
            'unknown option "endpoint"; did you mean "endpoint_override"?',
        ),
        ("s3://key:secret@x/y", "s3://x/y: allowed: a folder, or s3://bucket/prefix"),
        ("s3://", "allowed: a folder, or s3://bucket/prefix"),
    ],
)
def test_a_wrong_place_is_said_in_one_line_before_any_work(
    tmp_path: Path,
    server: ObjectStore,
    monkeypatch: pytest.MonkeyPatch,
    given: str,
    said: str,
) -> None:
    monkeypatch.setattr(locations, "ATTEMPTS", 1)
    (tmp_path / "spec.yaml").write_text(SMALL)
    with closing(Line()) as cut:
        place = given.format(port=server.port, free=cut.port)
        done = command(tmp_path, "launch", "spec.yaml", "--results", place)
    assert done.returncode == 2
    [line] = done.stderr.splitlines()
    assert said in line
    assert "secret" not in line


def test_an_object_store_that_refuses_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    error = (
        "When listing: AWS Error ACCESS_DENIED during ListObjectsV2 operation: Access"
        " Denied (Request ID: 1)"
    )
    said = ObjectServer().trouble(ObjectPath(ObjectServer(), "x/y"), OSError(error))
    assert not isinstance(said, UnreachableError)
    assert str(said).startswith("s3://x/y: the object store rejects the request (")
    assert "AWS_ACCESS_KEY_ID" in str(said)
    monkeypatch.setattr(locations.time, "sleep", lambda _: pytest.fail("waited"))
    with pytest.raises(StoreError):
        locations.patiently(lambda: raising(said))


def raising(error: Exception) -> None:
    raise error


def in_memory() -> tuple[Memory, Store]:
    """A study in an object store that can be made to end after so many requests."""
    server, memory = ObjectServer(), Memory()
    server.__dict__["files"] = memory
    return memory, Store(ObjectPath(server, "bucket/study"))


def three_parts(store: Store) -> None:
    for index in range(3):
        append(store, {"a": str(index), f"b{index}": "ok"})


def add_a_part(store: Store) -> None:
    append(store, {"a": "new", "c": "new"})


def crashes(act: Callable[[Store], object]) -> Iterator[Store]:
    """Stores of three parts after `act`, with a crash after each of its requests in
    turn, and at last with none.
    """
    memory, store = in_memory()
    three_parts(store)
    objects, whole, requests = dict(memory.objects), False, 0
    while not whole:
        memory.objects, memory.requests, memory.allowed = dict(objects), 0, requests
        try:
            act(Store(store.folder))
            whole = True
        except Crashed:
            requests += 1
        memory.allowed = sys.maxsize
        yield Store(store.folder)


def test_a_crash_after_any_request_of_a_store_loses_and_doubles_nothing() -> None:
    _, untouched = in_memory()
    three_parts(untouched)
    before = sorted_tables(untouched)
    add_a_part(untouched)
    found = [sorted_tables(store) for store in crashes(add_a_part)]
    assert len(found) > 4
    assert found[:-1] == [before] * (len(found) - 1)
    assert found[-1] == sorted_tables(untouched)


def test_a_crash_after_any_request_of_merging_loses_and_doubles_nothing() -> None:
    _, untouched = in_memory()
    three_parts(untouched)
    before, states = sorted_tables(untouched), 0
    for store in crashes(Store.compact):
        assert sorted_tables(store) == before
        store.compact()
        assert sorted_tables(store) == before
        assert len(store.all_parts()) == 1
        states += 1
    assert states > 20


def test_a_crash_after_any_request_of_deleting_a_part_leaves_it_whole_or_gone() -> None:
    def delete_oldest(store: Store) -> None:
        store.discard(store.all_parts()[0])

    found = [
        set(store.read("series")["trial_id"].to_pylist())
        for store in crashes(delete_oldest)
    ]
    assert [len(trials) for trials in found] == [4, 4] + [3] * (len(found) - 2)


def test_a_crash_while_a_damaged_part_is_set_aside_leaves_it_to_be_set_aside() -> None:
    def cut_and_set_aside(store: Store) -> None:
        part = Store(store.folder).all_parts()[0]
        buckets._write(store.folder / "parts" / part.name / "trials.parquet", b"PAR1")
        set_aside_damaged(store)

    for store in crashes(cut_and_set_aside):
        set_aside_damaged(store)
        if len(store.all_parts()) == 2:
            assert set(store.trial_ids()) == {"a", "b1", "b2"}
            kept = [key for key in keys(store.folder) if key.startswith("damaged/")]
            assert {"trials.parquet", "series.parquet"} <= {
                key.split("/")[2] for key in kept
            }
        else:
            assert len(store.trial_ids()) == 4


def test_old_tables_without_a_manifest_are_tidied_by_whoever_has_the_whole(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    append(store, {"a": "ok"})
    with pytest.MonkeyPatch.context() as patch:
        upload = buckets._upload
        patch.setattr(
            buckets,
            "_upload",
            lambda file, path: die() if file.name == MANIFEST else upload(file, path),
        )
        with pytest.raises(Crashed):
            append(store, {"b": "ok"})
    assert store.trial_ids() == {"a": "ok"}
    everything = keys(store.folder)
    store.tidy()
    assert keys(store.folder) == everything
    monkeypatch.setattr(buckets, "LEFTOVER_SECONDS", -1.0)
    store.shared = True
    store.tidy()
    assert keys(store.folder) == everything
    store.shared = False
    store.tidy()
    assert len(keys(store.folder)) == 3
    assert store.trial_ids() == {"a": "ok"}


def die() -> None:
    raise Crashed


DAMAGES = ["truncated", "flipped", "missing", "manifest"]


@pytest.mark.parametrize("what", slow_but(["flipped"], DAMAGES))
def test_a_damaged_part_is_set_aside_and_its_trials_run_again(
    results: ObjectPath, caplog: pytest.LogCaptureFixture, what: str
) -> None:
    relaunch(SMALL, results)
    whole, part = tables(results / "small"), Store(results / "small").all_parts()[0]
    assert isinstance(part, ObjectPath)
    file = ObjectPath(
        results.server,
        f"{part.key}/{MANIFEST if what == 'manifest' else 'series.parquet'}",
    )
    content = bytearray(file.open().read())
    if what == "missing":
        buckets._delete(file)
    elif what == "flipped":
        content[len(content) // 2] ^= 1
        while file.stat().st_mtime_ns <= (part / MANIFEST).stat().st_mtime_ns:
            buckets._write(file, bytes(content))
    else:
        buckets._write(file, bytes(content[: len(content) // 2]))
    with caplog.at_level(logging.WARNING):
        assert relaunch(SMALL, results).statuses.total() == 6
    said = {
        "truncated": " bytes of ",
        "flipped": "not match its checksum",
        "missing": "is missing",
        "manifest": "cannot be read",
    }
    assert said[what] in caplog.text
    assert f"set aside as {results}/small/damaged/{part.name}" in caplog.text
    assert tables(results / "small") == whole
    assert relaunch(SMALL, results).statuses.total() == 0


def test_reading_names_what_cannot_be_read_and_the_way_out(store: Store) -> None:
    part = append(store, {"a": "ok"})
    buckets._write(
        store.folder / "parts" / part.name / "trials.parquet", b"PAR1 nothing PAR1"
    )
    with pytest.raises(
        StoreError,
        match=(
            rf"s3://.*/trials.parquet: cannot be read .*delete s3://.*{part.name}/mani"
        ),
    ):
        store.read("trials")


def test_only_the_columns_that_are_asked_for_are_fetched(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a table of 2 MB that cannot be compressed."""
    noise = pa.array(os.urandom(1_000_000) for _ in range(2))
    store.append(
        {
            "trials": pa.table(
                {"trial_id": ["a", "b"], "status": ["ok", "ok"], "noise": noise}
            )
        }
    )
    fetched, opened = [0], ObjectPath.open

    class Counted:
        def __init__(self, file: Any) -> None:
            self.file, self.closed = file, False

        def read(self, size: int = -1) -> bytes:
            content: bytes = self.file.read(size)
            fetched[0] += len(content)
            return content

        def read_buffer(self, size: int = -1) -> pa.Buffer:
            return pa.py_buffer(self.read(size))

        def __getattr__(self, name: str) -> Any:
            return getattr(self.file, name)

    monkeypatch.setattr(
        ObjectPath, "open", lambda path, *_: pa.PythonFile(Counted(opened(path)), "r")
    )
    assert store.trial_ids() == {"a": "ok", "b": "ok"}
    assert 0 < fetched[0] < 200_000


def test_parts_are_merged_on_the_way(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweep.store.merging.MOST_GATHERED", 3)
    for index in range(7):
        append(store, {f"a{index}": "ok"})
        store.gather()
    assert len(store.all_parts()) == 3
    assert len(store.trial_ids()) == 7
    assert store.read("series").num_rows == 14


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lock_module, "STALE_SECONDS", 0.5)
    monkeypatch.setattr(lock_module, "WATCH_SECONDS", 0.5)
    monkeypatch.setattr(lock_module, "BEAT_SECONDS", 0.05)


def test_one_launch_at_a_time_or_one_for_each_share(store: Store) -> None:
    with (
        Lock(store.place),
        pytest.raises(
            StoreError, match=r"s3://.*/lock: this study is being launched by \S+ on"
        ),
    ):
        Lock(store.place).__enter__()
    with Lock(store.place, Share(1, 2)), Lock(store.place, Share(2, 2)):
        for share in (None, Share(1, 2), Share(1, 3)):
            with pytest.raises(
                StoreError, match=r"shard [12]/2 of this study is being launched by"
            ):
                Lock(store.place, share).__enter__()
    assert keys(store.folder) == []


def test_many_who_ask_at_once_have_it_one_after_the_other(store: Store) -> None:
    inside, most, entered, refused = [0], [0], [0], list[str]()

    def take() -> None:
        own = Store(ObjectPath(store.folder.server, store.folder.key))  # type: ignore[union-attr]
        for _ in range(2):
            try:
                with Lock(own.place):
                    inside[0] += 1
                    most[0], entered[0] = max(most[0], inside[0]), entered[0] + 1
                    time.sleep(0.01)
                    inside[0] -= 1
            except StoreError as error:
                refused.append(str(error))

    threads = [threading.Thread(target=take) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [one for one in refused if "is being launched by" not in one] == []
    assert len(refused) + entered[0] == 6
    assert most[0] == 1
    assert entered[0] >= 2
    assert keys(store.folder) == []


@pytest.mark.usefixtures("quick")
def test_a_silent_owner_is_taken_over_and_learns_of_it(
    store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    """It seems to be of another machine, falls silent, and writes its claim once more
    after that is taken away.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lock_module, "machine", lambda: "elsewhere")
        asleep = Lock(store.place)
        patch.setattr(asleep, "_beat", lambda: None)
        asleep._thread = threading.Thread(target=lambda: None)
        asleep.__enter__()
    written = (store.folder / "lock" / f"{asleep.token}.json").stat().st_mtime_ns
    own = store.folder / "clock"
    assert isinstance(own, ObjectPath)
    while not buckets._write(own, b"") and own.stat().st_mtime_ns < written + 1e9:
        time.sleep(0.1)
    taker = Lock(Store(store.folder).place)
    with caplog.at_level(logging.WARNING), taker:
        assert "taken over from" in caplog.text
        assert "without a sign of life for" in caplog.text
        buckets._write(store.folder / "lock" / f"{asleep.token}.json", b"{}")
        assert taker._claims.tokens() == [taker.token]
        assert not asleep._claims.touch(asleep.token)
        taker.check()


def test_what_a_living_owner_beats_is_left_alone(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lock_module, "BEAT_SECONDS", 0.02)
    with Lock(store.place) as held:
        file = store.folder / "lock" / f"{held.token}.json"
        before, deadline = file.stat().st_mtime_ns, time.monotonic() + PATIENCE
        while file.stat().st_mtime_ns == before:
            assert time.monotonic() < deadline
            time.sleep(0.05)
        held.check()


@pytest.fixture
def line(server: ObjectStore, monkeypatch: pytest.MonkeyPatch) -> Iterator[Line]:
    monkeypatch.setattr(locations, "ATTEMPTS", 1)
    monkeypatch.setattr(locations, "FIRST_PAUSE", 0.05)
    made = Line(server.port).mend()
    yield made
    made.close()


@pytest.mark.slow
def test_a_server_that_comes_back_is_waited_for(
    server: ObjectStore,
    line: Line,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    results = server.results("comes-back", line.port)
    append_a_part = store_module.Store.append

    def cut_first(store: Store, *tables: Any) -> Any:
        line.cut()
        threading.Timer(1.0, line.mend).start()
        return append_a_part(store, *tables)

    monkeypatch.setattr(store_module.Store, "append", cut_first)
    with caplog.at_level(logging.WARNING):
        assert relaunch(SMALL, results).statuses.total() == 6
    assert "the object store does not answer" in caplog.text
    relaunch(SMALL, tmp_path)
    assert tables(results / "small") == tables(tmp_path / "small")


def test_a_server_that_stays_away_costs_what_could_not_be_stored(
    server: ObjectStore, line: Line, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results, point = (
        server.results("stays-away", line.port),
        SMALL.replace("[0.5, 1]", "[0.5]"),
    )
    relaunch(point, results)
    with monkeypatch.context() as patch:
        append_a_part = store_module.Store.append
        patch.setattr(
            store_module.Store,
            "append",
            lambda *given: line.cut() or append_a_part(*given),
        )
        patch.setattr(locations, "PATIENCE_SECONDS", 0.3)
        with pytest.raises(
            StoreError, match=r"does not answer .* could not be stored: 3; launch again"
        ):
            relaunch(SMALL, results)
    line.mend()
    assert relaunch(SMALL, results).statuses.total() == 3
    relaunch(SMALL, tmp_path)
    assert tables(results / "small") == tables(tmp_path / "small")


def test_ctrl_c_ends_the_waiting(server: ObjectStore, line: Line) -> None:
    store = Store(server.results("interrupted", line.port) / "study")
    append(store, {"a": "ok"})
    line.cut()
    pressed = threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT))
    pressed.start()
    with pytest.raises(KeyboardInterrupt):
        append(store, {"b": "ok"})
    pressed.join()


def test_shares_add_up_in_an_object_store(results: ObjectPath, tmp_path: Path) -> None:
    from sweep.campaigns.launching import launch
    from sweep.spec.study import parse_spec
    from sweep.workers.executors import Serial

    done = [
        launch(parse_spec(SMALL), results, Serial(), share=Share(k, 2)).statuses.total()
        for k in (1, 2)
    ]
    assert sum(done) == 6
    relaunch(SMALL, tmp_path)
    assert tables(results / "small") == tables(tmp_path / "small")
    with (
        custody(Store(results / "small"), Share(1, 2)),
        pytest.raises(StoreError, match="shard 1/2"),
    ):
        relaunch(SMALL, results)


def test_a_search_is_stored_there_too(results: ObjectPath, tmp_path: Path) -> None:
    from sweep.methods.search.strategy import search
    from sweep.spec.study import parse_spec
    from sweep.workers.executors import Serial
    from tests.searches import TINY

    spec = parse_spec(TINY.replace("budget: 30", "budget: 4"))
    search(spec, results, Serial())
    assert search(spec, results, Serial()).statuses.total() == 0
    search(spec, tmp_path, Serial())
    there, here = (
        read_asked(StoredStudy("tiny", place)).table for place in (results, tmp_path)
    )
    assert there.equals(here)


def test_python_takes_the_same_places(
    bucket: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sweep

    run_trials_here(monkeypatch)
    monkeypatch.chdir(tmp_path)
    study = sweep.run(SMALL, results=bucket)
    assert len(study.trials) == 6
    assert sweep.load("small", results=bucket).trials.equals(study.trials)
    assert list(tmp_path.iterdir()) == []


def test_nothing_heavy_is_loaded_before_an_object_store_is_asked() -> None:
    script = (
        "import sys; from sweep.cli import app; assert 'pyarrow' not in sys.modules,"
        " 'pyarrow'"
    )
    subprocess.run([sys.executable, "-c", script], check=True, cwd=ROOT)
