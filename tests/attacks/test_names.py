"""What a study may be called, and that studies within each other do not meet."""

import json
from pathlib import Path

import pytest

from sweep.errors import SpecError
from sweep.spec.study import parse_spec
from sweep.spec.study_folder import OWN, STORED
from sweep.store.store import Store
from sweep.tables.cleaning import clean, find_waste
from sweep.tables.stored_study import StoredStudy
from sweep.workers.checkpoint_folder import Checkpoints
from tests.commands import sweep
from tests.faults.campaign import tables
from tests.studies import SMALL, launched, relaunch


def named(name: str) -> str:
    return SMALL.replace("study: small", f"study: {json.dumps(name)}")


@pytest.mark.parametrize("own", OWN)
@pytest.mark.parametrize("form", ["{}", "fresh/{}", "{}/fresh", "a/{}/b"])
def test_no_part_of_a_name_is_one_that_results_use(own: str, form: str) -> None:
    with pytest.raises(
        SpecError, match=f'is not allowed: "{own}" is reserved for files of results'
    ):
        parse_spec(named(form.format(own)))
    with pytest.raises(SpecError, match="is reserved for files of results"):
        parse_spec(named(form.format(own.upper())))


@pytest.mark.parametrize("name", ["con", "a/NUL", "aux.txt/b", "COM1", "ends.", "a./b"])
def test_a_name_is_a_folder_on_every_system(name: str) -> None:
    with pytest.raises(SpecError, match="cannot be the name of a folder on Windows"):
        parse_spec(named(name))


@pytest.mark.parametrize("name", ["console", "a/common1", "nul_", "a.b", "lpt"])
def test_a_name_that_only_looks_like_that_is_allowed(name: str) -> None:
    assert parse_spec(named(name)).name == name


def test_the_names_are_those_that_a_launch_and_a_reproduction_make(
    tmp_path: Path,
) -> None:
    """A file that the store learns to write must be entered in the layout."""
    seen = set[str]()
    study = launched(SMALL, tmp_path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sweep.trial.simulation.BOID_STEPS_A_CALL", 60)
        store, long = (
            study.store,
            SMALL.replace("steps: 9", "steps: 30") + "checkpoint: 1.0e-9\n",
        )

        def note(_self: Checkpoints, _trials: object) -> None:
            seen.update(path.name for path in store.folder.iterdir())

        patch.setattr(Checkpoints, "discard", note)
        next(store.folder.glob("parts/*/trials.parquet")).write_text("damaged")
        relaunch(long, tmp_path)
    (store.folder / "asked.parquet").touch()  # of a search up to version 0.18
    seen |= {path.name for path in store.folder.iterdir()}
    assert seen == set(STORED)


@pytest.mark.parametrize(
    "name", ["fresh/lock", "fresh/plan.parquet", "damaged", "a/spec.yaml"]
)
def test_studies_of_older_versions_with_such_names_are_read(
    tmp_path: Path, name: str
) -> None:
    relaunch(named("fresh2"), tmp_path / "results")
    (tmp_path / "results" / name).parent.mkdir(exist_ok=True)
    (tmp_path / "results" / "fresh2").rename(tmp_path / "results" / name)
    assert StoredStudy(name, tmp_path / "results").statuses() == {"done": 6}
    assert sweep(tmp_path, "table", name).returncode == 0


def test_studies_within_each_other_do_not_meet(tmp_path: Path) -> None:
    """Launched, extended, damaged, cleaned and merged in
    turn, each keeps what it has.
    """
    names = ["a", "a/b", "a/b/c"]
    for name in names:
        launched(named(name).replace("seed: 5", f"seed: {len(name)}"), tmp_path)
    whole = {name: tables(tmp_path / name) for name in names}
    for name in names:
        spec = named(name).replace("seed: 5", f"seed: {len(name)}")
        next((tmp_path / name / "parts").glob("*/trials.parquet")).write_text("damaged")
        assert relaunch(spec, tmp_path).statuses.total() == 6
        relaunch(spec.replace("replicates: 3", "replicates: 4"), tmp_path)
        relaunch(spec, tmp_path)
        study = StoredStudy(name, tmp_path)
        assert sum(find_waste(study).trials.values()) == 2
        clean(study, find_waste(study))
        Store(tmp_path / name).compact()
        assert {one: tables(tmp_path / one) for one in names} == whole
    assert all(StoredStudy(name, tmp_path).statuses() == {"done": 6} for name in names)
