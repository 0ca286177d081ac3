"""Exported tables come back with the same bits, from every format, with units,
provenance and a checksum.
"""

import hashlib
import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import xarray as xr
from pyarrow import csv

import sweep.tables.exporting as exporting
import sweep.tables.netcdf as netcdf
from kernels.model import BODY_COLUMNS, flaw
from sweep.errors import ChoiceError, OutputError
from sweep.loaded import LoadedStudy
from sweep.spec.recorded import columns_of
from sweep.tables.exporting import export
from sweep.tables.stored_study import StoredStudy
from tests import builders, oscillators
from tests.cases import slow_but
from tests.commands import sweep
from tests.studies import COVERING, IMPOSSIBLE, SMALL, launched, relaunch

KEPT = COVERING.replace(
    "heatmaps: true", "heatmaps: true, trajectories: true, every: 8"
)
KEPT_SMALL = SMALL.replace("series:", "trajectories: true, series:")
TABLES = ("trials", "series", "heatmaps", "trajectories")
ENDINGS = (".parquet", ".arrow", ".csv", ".nc")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(KEPT, tmp_path_factory.mktemp("kept"))


def test_another_reader_gets_exactly_the_trials_of_the_study(tmp_path: Path) -> None:
    """The stored parts have more: the spec of the study has lost a point."""
    launched(SMALL.replace("[0.5, 1]", "[0.5, 1, 2]"), tmp_path)
    launched(SMALL, tmp_path)
    small = LoadedStudy("small", tmp_path)
    path = tmp_path / "small.parquet"
    small.export(path)
    read = duckdb.sql(f"SELECT * FROM '{path}'").df()
    pd.testing.assert_frame_equal(
        read, small.trials, check_dtype=False, check_column_type=False
    )
    parts = small.store.folder / "parts" / "*" / "trials.parquet"
    stored = duckdb.sql(f"SELECT count(*) FROM '{parts}'").fetchall()[0][0]
    assert (len(read), stored) == (6, 9)
    part = small.where("separation_weight < 1")
    part.export(path, "series", force=True)
    assert duckdb.sql(f"SELECT * FROM '{path}'").df()["speed"].tolist() == (
        part.series["speed"].tolist()
    )


def bits(column: Any) -> bytes:
    """The bytes of all numbers of a column, lists one after the other; or its texts."""
    if isinstance(column, pa.ChunkedArray):
        column = column.combine_chunks()
        column = (
            column.flatten() if pa.types.is_list(column.type) else column
        ).to_numpy(zero_copy_only=False)
    column = np.asarray(column)
    return (
        repr(column.tolist()).encode() if column.dtype.kind == "O" else column.tobytes()
    )


def in_order(study: StoredStudy, table: str) -> pa.Table:
    """The stored table in the order of the plan, by another way than the export's."""
    ids = study.plan["trial_id"].to_pylist()
    return pa.concat_tables(
        study.store.read(table, trial_ids=pa.array([trial])) for trial in ids
    )


@pytest.mark.parametrize(
    ("ending", "table"),
    slow_but(
        [
            *((".parquet", "trials"), (".arrow", "series")),
            *((".parquet", "heatmaps"), (".arrow", "trajectories")),
        ],
        [*product((".parquet", ".arrow"), TABLES)],
    ),
)
def test_arrow_and_parquet_have_the_table_with_its_units(
    study: StoredStudy, tmp_path: Path, table: str, ending: str
) -> None:
    path = tmp_path / f"file{ending}"
    export(study, path, table)
    read = (
        pq.read_table(path)
        if ending == ".parquet"
        else pa.ipc.open_file(path).read_all()
    )
    stored = in_order(study, table)
    assert read.column_names == stored.column_names
    assert [bits(read[name]) for name in read.column_names] == [
        bits(stored[name]) for name in read.column_names
    ]
    assert [field.metadata for field in read.schema] == [
        field.metadata for field in stored.schema
    ]
    about = json.loads(read.schema.metadata[b"boidsweep"])
    assert about["spec"] == study.spec
    assert [origin["trials"] for origin in about["origins"]] == [4]
    assert about["origins"][0]["cpu"] == study.provenance["cpu"]


def test_csv_reads_back_to_the_same_bits(study: StoredStudy, tmp_path: Path) -> None:
    path, stored = tmp_path / "file.csv", in_order(study, "trials")
    export(study, path)
    frame = pd.read_csv(path)
    for name in ("coverage", "coverage_cv_mean", "cohesion_weight", "seconds"):
        assert bits(frame[name]) == bits(stored[name]), name
        assert [float(text) for text in pd.read_csv(path, dtype=str)[name]] == stored[
            name
        ].to_pylist()
    assert frame["trial_id"].tolist() == stored["trial_id"].to_pylist()
    about = json.loads((tmp_path / "file.csv.json").read_text())
    assert about["columns"]["coverage"]["unit"] == "%"
    assert about["provenance"]["spec"] == study.spec


def test_any_number_survives_csv(study: StoredStudy, tmp_path: Path) -> None:
    """200,000 random bit patterns, and the odd ones: every float but the payload of a
    NaN.
    """
    patterns = (
        np.random.default_rng(7)
        .integers(0, 2**64, 200_000, dtype=np.uint64)
        .view(np.float64)
    )
    odd = [
        0.0,
        -0.0,
        np.inf,
        -np.inf,
        np.nan,
        5e-324,
        1.7976931348623157e308,
        0.1,
        1e22,
        123456789012345680.0,
    ]
    numbers = np.concatenate([np.where(np.isnan(patterns), np.nan, patterns), odd])
    exporting._write_csv(pa.table({"x": numbers}), tmp_path / "x.csv", study)
    assert (
        csv.read_csv(tmp_path / "x.csv")["x"].to_numpy().tobytes() == numbers.tobytes()
    )


def test_csv_has_one_row_a_boid_and_one_a_pixel(
    study: StoredStudy, tmp_path: Path
) -> None:
    export(study, tmp_path / "flight.csv", "trajectories")
    flight, stored = (
        csv.read_csv(tmp_path / "flight.csv"),
        in_order(study, "trajectories"),
    )
    assert flight.column_names == ["trial_id", "frame", "boid", "x", "y", "vx", "vy"]
    assert flight["boid"].to_pylist() == list(range(10)) * 16
    assert flight["frame"].to_pylist() == list(np.repeat([0, 8, 16, 20] * 4, 10))
    assert all(
        bits(flight[name].cast(pa.float64())) == bits(stored[name])
        for name in ("x", "y", "vx", "vy")
    )
    some = study.plan["trial_id"].to_pylist()[:2]
    export(study, tmp_path / "visits.csv", "heatmaps", trials=some)
    visits = csv.read_csv(tmp_path / "visits.csv")
    assert visits.column_names == ["trial_id", "row", "column", "visits"]
    assert visits.num_rows == 2 * 480_000
    first = (
        visits.slice(0, 480_000)
        .to_pandas()
        .pivot(index="row", columns="column", values="visits")
    )
    assert (first.to_numpy() == study.heatmaps["visits"][0]).all()


def opened(path: Path) -> xr.Dataset:
    with xr.open_dataset(path, engine="netcdf4") as data:
        return data.load()


def test_netcdf_has_arrays_by_trial_with_units_and_settings(
    study: StoredStudy, tmp_path: Path
) -> None:
    for table in TABLES:
        export(study, tmp_path / f"{table}.nc", table)
    trials, series, maps, flights = (
        opened(tmp_path / f"{table}.nc") for table in TABLES
    )
    stored = in_order(study, "trials")
    assert trials["trial"].values.tolist() == study.plan["trial_id"].to_pylist()
    assert bits(trials["coverage_mean"]) == bits(stored["coverage_mean"])
    assert trials["coverage"].attrs["units"] == "%"
    assert trials["map"].values.tolist() == ["cafeteria"] * 4
    assert bits(series["coverage"].values.ravel()) == bits(
        in_order(study, "series")["coverage"]
    )
    assert series["frame"].values.tolist() == [0, 8, 16, 20]
    assert series["cohesion_weight"].values.tolist() == [0.1, 0.1, 0.2, 0.2]
    assert bits(flights["vy"].values.ravel()) == bits(
        in_order(study, "trajectories")["vy"]
    )
    assert flights["x"].dims == ("trial", "frame", "boid")
    assert maps["visits"].shape == (4, 600, 800)
    assert (maps["visits"].values[3] == study.heatmaps["visits"][3]).all()
    assert json.loads(str(trials["provenance"].values))["spec"] == study.spec


@pytest.fixture(scope="module")
def oscillating(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StoredStudy]:
    """A study whose boids have state and kinds."""
    with builders.entered(oscillators.MODEL, order=oscillators.ORDER):
        yield launched(oscillators.SPEC, tmp_path_factory.mktemp("circles"))


def test_state_and_kinds_are_columns_of_every_format(
    oscillating: StoredStudy, tmp_path: Path
) -> None:
    for ending in ENDINGS:
        export(oscillating, tmp_path / f"flights{ending}", "trajectories")
    stored = in_order(oscillating, "trajectories")
    kinds = ([0] * 3 + [1] * 9) * 24
    flat = csv.read_csv(tmp_path / "flights.csv")
    arrays = opened(tmp_path / "flights.nc")
    for name in ("phase", "frequency"):
        assert bits(flat[name]) == bits(stored[name])
        assert bits(arrays[name].values.ravel()) == bits(stored[name])
        assert arrays[name].dims == ("trial", "frame", "boid")
        assert bits(pq.read_table(tmp_path / "flights.parquet")[name]) == bits(
            stored[name]
        )
    assert (stored["kind"].combine_chunks().flatten().to_pylist()) == kinds
    assert flat["kind"].to_pylist() == kinds
    assert arrays["kind"].values.ravel().tolist() == kinds
    assert arrays["phase"].attrs == {
        "units": "radians",
        "long_name": "phase of the oscillator",
    }
    assert arrays["frequency"].attrs["units"] == "1/step"
    assert arrays["kind"].attrs == {"long_name": "kinds: 0 pacemaker, 1 follower"}
    frame = oscillating.trajectories
    assert list(frame)[2:] == ["x", "y", "vx", "vy", "phase", "frequency", "kind"]
    about = json.loads((tmp_path / "flights.csv.json").read_text())
    assert about["columns"]["phase"]["unit"] == "radians"


def test_no_state_can_have_the_name_of_another_column(
    oscillating: StoredStudy, tmp_path: Path
) -> None:
    """Of those that each format has beside the state, and settings."""
    own = {"phase", "frequency"}
    export(oscillating, tmp_path / "flights.csv", "trajectories")
    found = set(csv.read_csv(tmp_path / "flights.csv").column_names)
    data = netcdf.dataset(
        exporting.ordered_rows(oscillating, "trajectories"), oscillating
    )
    found |= {str(name) for name in data.variables} - set(oscillating.varied)
    found |= set(in_order(oscillating, "trajectories").column_names)
    assert found - own == set(BODY_COLUMNS) - {"index"}
    about = oscillators.MODEL.state["phase"]
    for name in (*BODY_COLUMNS, *oscillating.varied):
        assert name in flaw(oscillators.MODEL._replace(state={name: about}))


def test_netcdf_pads_what_is_shorter_or_smaller(tmp_path: Path) -> None:
    spec = SMALL.replace("every: 2", "every: 2, trajectories: true").replace(
        "n: 12, steps: 9", "drag: 0"
    )
    sizes = "sizes: {zip: {n: [3, 5], steps: [4, 7]}}"
    study = launched(
        spec.replace("separation_weight: [0.5, 1]", sizes).replace(
            "replicates: 3", "replicates: 1"
        ),
        tmp_path,
    )
    data = netcdf.dataset(exporting.ordered_rows(study, "trajectories"), study)
    assert data["frame"].values.tolist() == [0, 2, 4, 6, 7]
    assert data["x"].shape == (2, 5, 5)
    there = ~np.isnan(data["x"].values)
    assert there.sum(axis=2).tolist() == [[3, 3, 3, 0, 0], [5, 5, 5, 5, 5]]
    _, flight = study.trajectory(study.plan["trial_id"][0].as_py())
    assert (data["x"].values[0, :3, :3] == flight[:, 0]).all()


def test_maps_of_different_sizes_are_padded(study: StoredStudy) -> None:
    table = exporting.ordered_rows(study, "heatmaps")
    small = {
        "trial_id": table["trial_id"][:2],
        "rows": [2, 1],
        "columns": [1, 3],
        "visits": [[4, 5], [6, 7, 8]],
    }
    visits, about = netcdf._maps(pa.table(small))["visits"][1:]
    assert visits.tolist() == [[[4, -2, -2], [5, -2, -2]], [[6, 7, 8], [-2, -2, -2]]]
    assert "-2 outside" in about["text"]


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_checksum_is_that_of_the_file_as_sha256sum_has_it(
    study: StoredStudy, tmp_path: Path, ending: str
) -> None:
    path = tmp_path / f"some file{ending}"
    done = export(study, path)
    assert done.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert sorted(done.files) == sorted(tmp_path.iterdir())
    checked = subprocess.run(
        ["sha256sum", "-c", f"{path.name}.sha256"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (checked.returncode, checked.stdout) == (0, f"{path.name}: OK\n")
    path.write_bytes(path.read_bytes()[:-1] + b"\0")
    assert (
        subprocess.run(
            ["sha256sum", "-c", f"{path.name}.sha256"],
            cwd=tmp_path,
            capture_output=True,
            check=False,
        ).returncode
        == 1
    )


def test_trials_that_left_the_spec_stay_out(study: StoredStudy, tmp_path: Path) -> None:
    results = tmp_path / "results"
    shutil.copytree(study.store.folder.parent, results)
    relaunch(study.spec.replace("[0.1, 0.2]", "[0.2]"), results)
    less = StoredStudy("covering", results)
    assert export(less, tmp_path / "less.csv").rows == 2
    assert (
        csv.read_csv(tmp_path / "less.csv")["trial_id"].to_pylist()
        == less.plan["trial_id"].to_pylist()
    )


def test_failed_trials_are_rows_with_their_error(tmp_path: Path) -> None:
    study = launched(IMPOSSIBLE, tmp_path / "results")
    for ending in ENDINGS:
        assert export(study, tmp_path / f"failed{ending}").rows == 6
    options = csv.ParseOptions(newlines_in_values=True)
    read = csv.read_csv(tmp_path / "failed.csv", parse_options=options)
    assert read["error"].to_pylist() == in_order(study, "trials")["error"].to_pylist()
    assert read["speed"].null_count == 6
    assert np.isnan(opened(tmp_path / "failed.nc")["speed"].values).all()


MISTAKES = [
    (
        "file.parqet",
        "trials",
        'unknown kind of file ".parqet"; did you mean ".parquet"?',
    ),
    ("file", "trials", 'unknown kind of file ""'),
    ("file.csv", "trails", 'unknown table "trails"; did you mean "trials"?'),
    ("nowhere/file.csv", "trials", "there is no folder"),
]


@pytest.mark.parametrize(("name", "table", "message"), MISTAKES)
def test_a_mistake_is_named_and_nothing_written(
    study: StoredStudy, tmp_path: Path, name: str, table: str, message: str
) -> None:
    with pytest.raises((ChoiceError, OutputError)) as error:
        export(study, tmp_path / name, table)
    assert message in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_stored_is_said(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    with pytest.raises(
        ChoiceError, match=r"no heatmaps are stored; record: \{heatmaps"
    ):
        export(study, tmp_path / "maps.nc", "heatmaps")


@pytest.mark.parametrize("taken", ["file.csv", "file.csv.json", "file.csv.sha256"])
def test_an_existing_file_is_replaced_only_by_force(
    study: StoredStudy, tmp_path: Path, taken: str
) -> None:
    (tmp_path / taken).write_text("mine")
    with pytest.raises(
        OutputError, match=f"{taken}: exists already; --force replaces it"
    ):
        export(study, tmp_path / "file.csv")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]
    export(study, tmp_path / "file.csv", force=True)
    assert (tmp_path / taken).read_text() != "mine"


def test_a_write_that_fails_leaves_the_old_file(
    study: StoredStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file.parquet").write_text("mine")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(exporting.WRITERS, ".parquet", full)
    with pytest.raises(
        OutputError,
        match=r"file.parquet: cannot be written \(No space left on device\)",
    ):
        export(study, tmp_path / "file.parquet", force=True)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["mine"]


def test_without_its_packages_netcdf_says_what_to_install(
    study: StoredStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(netcdf, "find_spec", lambda _name: None)
    with pytest.raises(
        ChoiceError, match=r'which are not installed: pip install "boidsweep\[netcdf\]"'
    ):
        export(study, tmp_path / "file.nc")
    assert list(tmp_path.iterdir()) == []


def test_the_command_prints_the_checksum(study: StoredStudy, tmp_path: Path) -> None:
    command = [
        "export",
        "covering",
        "--to",
        "speed.csv",
        "--results",
        str(study.store.folder.parent),
    ]
    done = sweep(tmp_path, *command)
    assert done.returncode == 0, done.stderr
    assert done.stdout == (tmp_path / "speed.csv.sha256").read_text()
    again = sweep(tmp_path, *command)
    assert again.returncode == 2
    assert again.stderr == "speed.csv: exists already; --force replaces it\n"


def test_some_trials_and_columns_are_exported(
    study: StoredStudy, tmp_path: Path
) -> None:
    trials = study.trials
    varied = study.varied
    first, *_, last = trials["trial_id"]
    path = tmp_path / "some.csv"
    done = export(
        study, path, trials=[last, first[:12]], columns=["varied", "metrics", "seed"]
    )
    assert done.rows == 2
    read = csv.read_csv(path).to_pandas()
    assert list(read) == ["trial_id", *varied, *columns_of(study.metrics), "seed"]
    assert read["trial_id"].tolist() == [first, last]
    wanted = trials.set_index("trial_id").loc[[first, last], list(read)[1:]]
    pd.testing.assert_frame_equal(
        read.set_index("trial_id"), wanted, check_dtype=False, check_exact=True
    )
    about = json.loads((tmp_path / "some.csv.json").read_text())
    assert [*about["columns"]] == list(read)


@pytest.mark.parametrize("ending", ENDINGS)
def test_each_format_has_the_columns_that_are_asked_for(
    ending: str, study: StoredStudy, tmp_path: Path
) -> None:
    path = tmp_path / f"some{ending}"
    one = study.trials["trial_id"][1]
    done = export(study, path, "trajectories", trials=one, columns=["vy", "x"])
    assert done.rows == (4 * 10 if ending == ".csv" else 4)
    found = {
        ".csv": lambda: list(pd.read_csv(path)),
        ".parquet": lambda: pq.read_table(path).column_names,
        ".arrow": lambda: pa.ipc.open_file(path).read_all().column_names,
        ".nc": lambda: [*opened(path).data_vars],
    }[ending]()
    boid = ["boid"] if ending == ".csv" else []
    keys = ["provenance"] if ending == ".nc" else ["trial_id", "frame", *boid]
    assert sorted(found) == sorted([*keys, "vy", "x"])


WRONG = [
    ({"columns": ["polarisation"]}, 'unknown column "polarisation"; did you mean "pol'),
    ({"columns": ["varyed"]}, 'unknown column "varyed"; did you mean "varied"?'),
    ({"columns": "metrics", "table": "series"}, "metrics are columns of trials; this"),
    ({"trials": ["zz"]}, 'unknown trial "zz"'),
]


@pytest.mark.parametrize(("asked", "said"), WRONG)
def test_what_is_not_there_cannot_be_chosen(
    asked: dict[str, Any], said: str, tmp_path: Path
) -> None:
    small = launched(KEPT_SMALL, tmp_path / "results")
    with pytest.raises(ChoiceError, match=re.escape(said)):
        export(small, tmp_path / "x.csv", **asked)
    assert not list(tmp_path.glob("x.csv*"))


def test_the_command_exports_what_is_chosen_and_counts_the_rows_of_the_file(
    tmp_path: Path,
) -> None:
    small = launched(KEPT_SMALL, tmp_path / "results")
    command = ["export", "small", "--to", "x.csv", "--table", "trajectories"]
    done = sweep(tmp_path, *command)
    rows = len(pd.read_csv(tmp_path / "x.csv"))
    assert done.stderr.startswith(f"{rows:,} rows of trajectories in x.csv, ")
    assert rows == len(small.trajectories) * 12
    trial = small.trials["trial_id"].iloc[-1]
    more = ["--force", "--trial", trial, "--columns", "x, y"]
    done = sweep(tmp_path, *command, *more)
    assert f" {len(pd.read_csv(tmp_path / 'x.csv')):,} rows of" in f" {done.stderr}"
    assert set(pd.read_csv(tmp_path / "x.csv")["trial_id"]) == {trial}
    where = ["--force", "--where", "separation_weight < 0.7"]
    done = sweep(tmp_path, *command, *where)
    there = small.where("separation_weight < 0.7").trials["trial_id"]
    assert set(pd.read_csv(tmp_path / "x.csv")["trial_id"]) == {*there}
    both = sweep(tmp_path, *command, *where, "--trial", trial)
    assert both.returncode == 2
    assert "is not a trial of the spec at the chosen points" in both.stderr
    wrong = sweep(tmp_path, *command, "--force", "--columns", "vz")
    assert wrong.returncode == 2
    assert 'unknown column "vz"' in wrong.stderr
