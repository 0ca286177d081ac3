"""The scripts for clusters run as they are, by a Slurm that is none but acts so."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest

from sweep.spec.built_in import EXAMPLES
from sweep.store.locations import location
from sweep.tables.stored_study import StoredStudy
from tests.cluster.slurm import submit
from tests.object_stores import object_store
from tests.studies import SMALL, launched

SCRIPTS = EXAMPLES / "cluster"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A user's folder, with the scripts, a spec and a folder for logs."""
    user = tmp_path / "user"
    shutil.copytree(SCRIPTS, user)
    (user / "small.yaml").write_text(SMALL, encoding="utf-8")
    (user / "logs").mkdir()
    return user


def variables(tmp_path: Path) -> dict[str, str]:
    """Where boidsweep is installed, and what is compiled already."""
    cache = {"NUMBA_CACHE_DIR": os.environ["XDG_CACHE_HOME"]}
    return {"VENV": sys.prefix, "TMPDIR": str(tmp_path)} | cache


def same(study: StoredStudy, tmp_path: Path) -> None:
    """Whether its trials are those of a launch here."""
    here = launched(SMALL, tmp_path / "here").trials
    pd.testing.assert_frame_equal(
        here.drop(columns="seconds"), study.trials.drop(columns="seconds")
    )


@pytest.mark.parametrize("script", sorted(SCRIPTS.iterdir()), ids=lambda one: one.name)
def test_a_script_is_bash_and_names_no_folder_of_its_own(script: Path) -> None:
    if script.suffix in (".sh", ".sbatch"):
        subprocess.run(["bash", "-n", script], check=True)
    text = script.read_text(encoding="utf-8")
    assert "dirname" not in text  # Slurm runs a copy from elsewhere
    assert not re.search(r"[ \t]$", text, re.MULTILINE)


@pytest.mark.slow
def test_an_array_runs_all_shares_into_one_study(folder: Path, tmp_path: Path) -> None:
    done = submit(
        folder,
        folder / "array.sbatch",
        *("--array=1-2", "--cpus-per-task=1", "small.yaml"),
        **variables(tmp_path),
    )
    logs = [path.read_text(encoding="utf-8") for path in folder.glob("logs/*.log")]
    assert done.returncode == 0, (done, logs)
    assert {path.name for path in folder.glob("logs/*")} == {
        "boidsweep-7-1.log",
        "boidsweep-7-2.log",
    }
    same(StoredStudy("small", folder / "results"), tmp_path)


@pytest.mark.slow
def test_an_array_stores_into_a_bucket(folder: Path, tmp_path: Path) -> None:
    with object_store() as store:
        url = store.url("cluster")
        done = submit(
            folder,
            folder / "s3.sbatch",
            *("--array=1-2", "--cpus-per-task=1", "small.yaml"),
            **variables(tmp_path) | {"RESULTS": url, "SPREAD_SECONDS": "1"},
        )
        logs = [path.read_text(encoding="utf-8") for path in folder.glob("logs/*.log")]
        assert done.returncode == 0, (done, logs)
        same(StoredStudy("small", location(url)), tmp_path)
    assert not (folder / "results").exists()


@pytest.mark.slow
def test_a_job_with_a_scheduler_and_workers_leaves_nothing_running(
    folder: Path, tmp_path: Path
) -> None:
    done = submit(
        folder,
        folder / "dask.sbatch",
        *("--nodes=1", "--ntasks-per-node=2", "small.yaml"),
        **variables(tmp_path) | {"SCHEDULER_HOST": "127.0.0.1"},
    )
    [log] = [path.read_text(encoding="utf-8") for path in folder.glob("logs/*.log")]
    assert done.returncode == 0, (done, log)
    assert "6 new trials (6 done)" in log
    assert not list(folder.glob("scheduler-*"))
    same(StoredStudy("small", folder / "results"), tmp_path)
