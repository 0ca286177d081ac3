"""Shares of a study that are launched apart add up to the study, whoever comes when, is
killed, or merges.
"""

import logging
import os
import re
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from sweep.campaigns.launching import launch
from sweep.cli import main
from sweep.errors import SpecError, StoreError
from sweep.spec.study import parse_spec
from sweep.store import lock as lock_module
from sweep.store.held_store import custody
from sweep.store.lock import Lock
from sweep.store.processes import started
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.workers.executors import Serial
from tests import ROOT
from tests.commands import run_trials_here
from tests.faults.campaign import tables
from tests.patience import PATIENCE
from tests.store.test_store import append, part_names
from tests.studies import OWN_SMALL, SMALL, launched, relaunch

SPEC = SMALL.replace("replicates: 3", "replicates: 20")
OWN = OWN_SMALL.replace("replicates: 3", "replicates: 20")
LAUNCHED = """
import sys
sys.path[:0] = [{root!r}]
from pathlib import Path
from sweep.workers.executors import Serial
from sweep.campaigns.launching import launch
from sweep.store.shares import Share
from sweep.store.writer import Writer
from tests.studies import read

Writer.__init__.__kwdefaults__["rows"] = 2
spec, results, share = sys.argv[1:]
sys.stdin.readline()
done = launch(read(spec), Path(results), Serial(), share=Share.parse(share))
print(done.statuses.total())
"""


def share(text: str, results: Path) -> int:
    """How many trials a launch of a share has run, in this process."""
    return launch(
        parse_spec(SPEC), results, Serial(), share=Share.parse(text)
    ).statuses.total()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    results = tmp_path_factory.mktemp("whole")
    launched(SPEC, results)
    return tables(results / "small")


@pytest.mark.slow
@pytest.mark.parametrize(
    "spec", [pytest.param(SPEC, id="ours"), pytest.param(OWN, id="own")]
)
def test_three_processes_at_once_add_up_to_one_launch(
    tmp_path: Path, spec: str
) -> None:
    """They begin together, store a part for every two trials, and merge as they go; a
    launch of the whole tidies up. Of own code each process has a copy in a folder.
    """
    script = LAUNCHED.format(root=str(ROOT))
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", script, spec, str(tmp_path), f"{number}/3"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for number in (1, 2, 3)
    ]
    ended = [process.communicate("go\n", timeout=PATIENCE) for process in processes]
    assert [process.returncode for process in processes] == [0] * 3, ended
    assert sum(int(output) for output, _ in ended) == 40
    launched(spec, tmp_path / "whole")
    assert tables(tmp_path / "small") == tables(tmp_path / "whole" / "small")
    store = Store(tmp_path / "small")
    assert len(store.all_parts()) == 3
    assert relaunch(spec, tmp_path).statuses.total() == 0
    assert list((tmp_path / "small" / "writing").iterdir()) == []
    assert not (tmp_path / "small" / "lock").exists()


def test_shares_one_after_the_other_and_then_the_whole(
    tmp_path: Path, whole: dict[str, str]
) -> None:
    done = [share(text, tmp_path) for text in ("2/2", "1/2", "1/2")]
    assert done[0] + done[1] == 40
    assert min(done[:2]) > 0
    assert done[2] == 0
    assert tables(tmp_path / "small") == whole
    assert relaunch(SPEC, tmp_path).statuses.total() == 0
    store = Store(tmp_path / "small")
    store.compact()
    assert len(store.all_parts()) == 1
    assert tables(tmp_path / "small") == whole


@pytest.mark.parametrize(
    ("held", "asked", "allowed"),
    [
        (None, None, False),
        (None, Share(1, 2), False),
        (Share(1, 2), None, False),
        (Share(1, 2), Share(1, 2), False),
        (Share(1, 2), Share(2, 3), False),
        (Share(1, 1), Share(1, 2), False),
        (Share(1, 2), Share(2, 2), True),
    ],
)
def test_what_excludes_what(
    tmp_path: Path, held: Share | None, asked: Share | None, allowed: bool
) -> None:
    store = Store(tmp_path / "study")
    with Lock(store.place, held):
        if allowed:
            with Lock(store.place, asked):
                assert len(store.place.lock.tokens()) == 2
        else:
            whose = f"shard {held} of this study" if held else "this study"
            with pytest.raises(StoreError, match=f"{whose} is being launched by"):
                Lock(store.place, asked).__enter__()
            assert len(store.place.lock.tokens()) == 1
    assert not (store.folder / "lock").exists()


def test_of_two_who_ask_the_smaller_token_waits_and_the_larger_lets_it_pass(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Step by step: neither holds while the other asks; the second learns that the
    first holds.
    """
    tokens = iter(["a", "b", "c"])
    monkeypatch.setattr(lock_module.secrets, "token_hex", lambda _: next(tokens))
    place, passed = Store(tmp_path / "study").place, list[bool]()
    first, second = Lock(place), Lock(place, Share(1, 2))
    first._ask()
    second._ask()
    assert not first._granted()
    monkeypatch.setattr(second, "_let_pass", lambda _: passed.append(first._granted()))
    assert not second._granted()
    assert passed == [True]
    with pytest.raises(StoreError, match="this study is being launched by"):
        second._granted()
    assert place.lock.tokens() == ["a", "c"]


@pytest.mark.slow
def test_of_two_who_exclude_each_other_and_ask_at_once_one_goes_on(
    tmp_path: Path,
) -> None:
    """The whole against a share, again and again, from threads that start together."""
    for number in range(20):
        store, together, went = (
            Store(tmp_path / str(number)),
            threading.Barrier(2),
            list[str](),
        )
        inside = threading.Lock()

        def take(asked: Share | None) -> None:
            own = Lock(Store(store.folder).place, asked)  # noqa: B023
            together.wait()  # noqa: B023
            try:
                with own:
                    assert inside.acquire(blocking=False)  # noqa: B023
                    went.append(str(asked))  # noqa: B023
                    time.sleep(0.01)
                    inside.release()  # noqa: B023
            except StoreError:
                pass

        threads = [
            threading.Thread(target=take, args=(asked,))
            for asked in (None, Share(1, 2))
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert 1 <= len(went) <= 2


def test_a_share_leaves_alone_what_others_have_and_write(tmp_path: Path) -> None:
    """Their parts are not merged, and what they are writing is not tidied away."""
    store, gone = (
        Store(tmp_path / "study"),
        subprocess.Popen([sys.executable, "-c", ""]),
    )
    gone.wait()
    others = [append(store, {f"other{index}": "ok"}) for index in range(3)]
    with custody(Store(store.folder), Share(1, 2)) as _:
        own = Store(store.folder)
        own.shared = True
        for index in range(3):
            append(own, {f"own{index}": "ok"})
        writing = store.folder / "writing" / f"elsewhere~{gone.pid}~part"
        writing.mkdir()
        own.compact()
    assert writing.exists()
    assert {part.name for part in others} <= part_names(store)
    assert len(part_names(store)) == 4
    assert len(store.trial_ids()) == 6


def test_a_damaged_part_is_set_aside_by_whoever_comes_first(
    tmp_path: Path, whole: dict[str, str], caplog: pytest.LogCaptureFixture
) -> None:
    """Another share has set it aside already when this one wants to: no error, and its
    trials run with their shares.
    """
    relaunch(SPEC, tmp_path)
    store = Store(tmp_path / "small")
    part = store.all_parts()[0]
    os.truncate(store.folder / "parts" / part.name / "trials.parquet", 10)
    with caplog.at_level(logging.WARNING):
        first = share("1/2", tmp_path)
    assert "run again with their shards" in caplog.text
    assert store.place.set_aside(part) is None
    assert 0 < first < 40
    assert share("2/2", tmp_path) == 40 - first
    assert tables(tmp_path / "small") == whole


def test_a_dead_share_is_taken_over_by_the_whole_and_by_itself_alone(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = Store(tmp_path / "study")
    dying = (
        "import os, sys; sys.path[:0] = [{root!r}]; from pathlib import Path; from"
        " sweep.store.lock import Lock; "
    )
    dying += (
        "from sweep.store.shares import Share; from sweep.store.store import Store; "
    )
    dying += "Lock(Store(Path({folder!r})).place, Share(1, 2)).__enter__(); os._exit(0)"
    script = dying.format(root=str(ROOT), folder=str(store.folder))
    subprocess.run([sys.executable, "-c", script], check=True)
    assert started(1) is not None
    with caplog.at_level(logging.WARNING), Lock(store.place, Share(2, 2)):
        assert len(store.place.lock.tokens()) == 2
    assert caplog.text == ""
    with caplog.at_level(logging.WARNING), Lock(store.place):
        assert "that process is gone" in caplog.text
        assert len(store.place.lock.tokens()) == 1


def test_the_command_runs_a_share_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "small.yaml"
    spec.write_text(SMALL)
    command = [
        "sweep",
        "launch",
        str(spec),
        "--workers",
        "1",
        "--results",
        str(tmp_path / "results"),
        "--shard",
    ]
    told, number = [], 0
    for text in ("1/2", "2/2"):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("sys.argv", [*command, text])
            run_trials_here(patch, lambda _workers: Serial())
            with suppress(SystemExit):
                main()
        told.append(capsys.readouterr().err)
        assert f"small, shard {text}: " in told[-1]
        number += int(re.search(r"(\d+) new trials?\b", told[-1])[1])
    assert number == 6
    assert set(Store(tmp_path / "results" / "small").trial_ids().values()) == {"done"}


@pytest.mark.parametrize(
    ("text", "said"),
    [("3", "not of the form 3/16"), ("3/2", "shards are 1/2 to 2/2")],
)
def test_the_command_refuses_what_is_no_share(
    text: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["sweep", "launch", "no.yaml", "--shard", text])
        with pytest.raises(SystemExit) as ending:
            main()
    assert ending.value.code == 2
    assert said in capsys.readouterr().err


def test_a_study_whose_trials_depend_on_the_stored_ones_cannot_be_shared(
    tmp_path: Path,
) -> None:
    rule = "replicates: {until: {metric: speed, half_width: 0.1}, max: 50}"
    study = parse_spec(SMALL.replace("replicates: 3", rule))
    with pytest.raises(
        SpecError, match=r"spec\.yaml:\d+: .*cannot be launched in shards"
    ):
        launch(study, tmp_path, Serial(), share=Share(1, 2))
