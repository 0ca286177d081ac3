"""A storage of optuna from a stranger, and passwords in URLs."""

import pickle
import sqlite3
import warnings
from pathlib import Path

import optuna
import pytest

from sweep.errors import OutputError, StoreError
from sweep.methods.search import exporting as module
from sweep.methods.search.exporting import PASSWORD, check_export
from sweep.store.locations import location
from tests.commands import sweep
from tests.searches import TINY

SPEC = TINY.replace("budget: 30", "budget: 4")


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://me:SECRET@host/db",
        "postgresql+psycopg://me:SECRET@host:5432/db?sslmode=require",
        "postgresql://me@host/db?password=SECRET",
        "mysql://me@host/db?passwd=SECRET",
        "postgresql://me:SEC/RET@host:x/db",
        "postgresql://:SECRET@",
    ],
)
def test_a_password_is_refused_and_never_said(tmp_path: Path, url: str) -> None:
    (tmp_path / "spec.yaml").write_text(SPEC)
    done = sweep(tmp_path, "search", "spec.yaml", "--export", url)
    assert done.returncode == 2
    [line] = done.stderr.splitlines()
    assert "SEC" not in line
    assert PASSWORD in line or "not the URL of a storage" in line
    assert not (tmp_path / "results").exists()


def test_the_password_of_the_environment_is_used_and_never_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(PASSWORD, "SEC:RET@/")
    used = module._with_password("postgresql://me@host/db", "")
    assert used == "postgresql://me:SEC%3ARET%40%2F@host/db"
    with pytest.raises(OutputError) as caught:
        check_export("postgresql+pg8000://me@127.0.0.1:1/db", "tiny")
    assert "SEC" not in str(caught.value)


@pytest.mark.parametrize(
    "place",
    [
        "s3://key:SECRET@bucket/x",
        "s3://key:SECRET@bucket",
        "s3://a@b:SECRET@c/x?region=y",
    ],
)
def test_credentials_in_a_place_of_results_are_refused_and_never_said(
    place: str,
) -> None:
    with pytest.raises(StoreError) as caught:
        location(place)
    assert "SECRET" not in str(caught.value)


class Payload:
    """Unpickling it makes a file."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def __reduce__(self) -> tuple[object, tuple[Path]]:
        return Path.touch, (self.file,)


def test_nothing_of_a_strangers_storage_is_run_or_written_over(tmp_path: Path) -> None:
    """Each text and number of its studies is a pickle or an escape, and a trigger
    refuses more of them.
    """
    storage, trap = f"sqlite:///{tmp_path}/theirs.db", tmp_path / "trap"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        theirs = optuna.create_study(storage=storage, study_name="tiny")
        theirs.optimize(lambda trial: trial.suggest_float("x", 0, 1), n_trials=2)
        theirs.set_user_attr("a", 1)
        theirs._storage._backend.engine.dispose()
    with sqlite3.connect(tmp_path / "theirs.db") as database:
        payload = pickle.dumps(Payload(trap), 0).decode()
        database.execute("update trial_params set distribution_json = ?", [payload])
        database.execute("update study_user_attributes set value_json = ?", [payload])
        before = list(database.iterdump())
    database.close()
    (tmp_path / "spec.yaml").write_text(SPEC)
    refused = sweep(tmp_path, "search", "spec.yaml", "--export", storage)
    assert refused.returncode == 2
    assert 'already has a study "tiny", which stays unchanged' in refused.stderr
    with sqlite3.connect(tmp_path / "theirs.db") as database:
        assert list(database.iterdump()) == before
        database.execute("update studies set study_name = 'theirs'")
        database.execute(
            "create trigger t before insert on studies begin select raise(abort,"
            " '\x1b]0;mine\x07'); end"
        )
    database.close()
    spoiled = sweep(tmp_path, "search", "spec.yaml", "--export", storage)
    assert spoiled.returncode == 2
    assert "cannot be written" in spoiled.stderr.splitlines()[-1]
    assert "\x1b" not in spoiled.stderr.splitlines()[-1]
    with sqlite3.connect(tmp_path / "theirs.db") as database:
        database.execute("drop trigger t")
    database.close()
    done = sweep(tmp_path, "search", "spec.yaml", "--export", storage)
    assert done.returncode == 0
    assert not trap.exists()
    pickle.loads(payload.encode())
    assert trap.exists()
