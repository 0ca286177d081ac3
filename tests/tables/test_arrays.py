"""A study as labelled arrays: axes and replicates as dimensions, with units."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from sweep.errors import ChoiceError
from sweep.loaded import LoadedStudy
from sweep.tables import netcdf
from sweep.tables.arrays import to_arrays
from sweep.tables.stored_study import StoredStudy
from tests.plotted import study
from tests.studies import SMALL, launched


def each(arrays: xr.Dataset, metric: str, trials: pd.DataFrame, dims: list[str]) -> int:
    """How many trials stand at their place; every other place is empty."""
    for _, trial in trials.iterrows():
        place = {name: trial[name] for name in (*dims, "replicate")}
        there = arrays.sel(place)
        assert there["trial_id"].item() == trial["trial_id"]
        assert there[metric].item() == trial[metric]
        assert there["seed"].item() == trial["seed"]
    assert int((arrays["trial_id"] != "").sum()) == len(trials)
    return len(trials)


def test_a_full_grid_has_a_dimension_for_each_axis() -> None:
    grid = study("grid")
    arrays = LoadedStudy(grid.name, grid.store.folder.parent).to_xarray()
    dims = ["separation_weight", "alignment_weight", "borders"]
    assert arrays["speed"].dims == (*dims, "replicate")
    assert arrays["speed"].shape == (3, 3, 2, 3)
    assert arrays["borders"].values.tolist() == ["torus", "bounded"]
    assert each(arrays, "speed", grid.trials, dims) == 54
    assert arrays["speed"].attrs["units"] == "px/step"
    assert arrays["steps"].item() == 8
    assert arrays["width"].attrs["units"] == grid.units["width"] == "px"
    assert arrays["point"].dims == tuple(dims)
    mean = arrays["speed"].mean("replicate")
    wanted = grid.trials.groupby(dims)["speed"].mean()
    for place, value in wanted.items():
        found = mean.sel(dict(zip(dims, place, strict=True))).item()
        assert found == pytest.approx(value)


def test_frames_come_after_the_replicate() -> None:
    grid = study("grid").where(borders="torus")
    arrays = to_arrays(grid, "series")
    assert arrays["flock_radius"].dims == (
        *("separation_weight", "alignment_weight", "replicate", "frame"),
    )
    trial = grid.trials.iloc[5]
    names = ("separation_weight", "alignment_weight", "replicate")
    found = arrays["flock_radius"].sel({name: trial[name] for name in names})
    series = grid.series[grid.series["trial_id"] == trial["trial_id"]]
    assert found.values.tolist() == series["flock_radius"].tolist()


def test_settings_that_are_drawn_together_are_one_dimension() -> None:
    drawn = study("drawn")
    arrays = to_arrays(drawn)
    assert arrays["speed"].dims == ("n", "weights", "replicate")
    assert arrays["speed"].shape == (2, 30, 2)
    assert arrays["cohesion_weight"].dims == ("weights",)
    seventh = arrays.isel(n=1, weights=7, replicate=1)
    row = drawn.trials.set_index("trial_id").loc[seventh["trial_id"].item()]
    assert row["cohesion_weight"] == seventh["cohesion_weight"].item()
    assert row["n"] == seventh["n"].item() == 12


UNEVEN: dict[str, Callable[[str], str]] = {
    "when": lambda spec: spec.replace(
        "  separation_weight: [0.5, 1]\n",
        "  separation_weight: [0.5, 1]\n"
        '  borders: {values: [torus, bounded], when: "separation_weight < 1"}\n',
    ),
    "require": lambda spec: (
        spec.replace(
            "  separation_weight: [0.5, 1]\n",
            "  separation_weight: [0.5, 1]\n  alignment_weight: [0.1, 0.7]\n",
        )
        + "require: [separation_weight + alignment_weight < 1.5]\n"
    ),
}


@pytest.mark.parametrize("change", UNEVEN.values(), ids=UNEVEN)
def test_what_is_no_full_grid_has_a_dimension_of_points(
    change: Callable[[str], str], tmp_path: Path
) -> None:
    uneven = launched(change(SMALL), tmp_path)
    arrays = to_arrays(uneven)
    assert arrays["speed"].dims == ("point", "replicate")
    assert arrays["separation_weight"].dims == ("point",)
    assert arrays["speed"].shape == (3, 3)
    assert each(arrays, "speed", uneven.trials, ["point"]) == 9


def test_what_is_not_stored_is_empty(tmp_path: Path) -> None:
    """A point with fewer trials, as `until` has; here its plan lists more."""
    small = launched(SMALL, tmp_path)
    lost = small.trials["trial_id"].tolist()[1]
    part = StoredStudy("small", tmp_path)
    part.plan = part.plan.filter(
        np.array([one != lost for one in small.plan["trial_id"].to_pylist()])
    )
    arrays = to_arrays(part)
    assert arrays["speed"].shape == (2, 3)
    assert int(arrays["speed"].isnull().sum()) == 1
    assert arrays["status"].isel(separation_weight=0, replicate=1).item() == ""
    assert each(arrays, "speed", part.trials, ["separation_weight"]) == 5


def test_a_dataset_is_written_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "grid.nc"
    arrays = to_arrays(study("grid"))
    arrays.to_netcdf(path, engine="netcdf4")
    with xr.open_dataset(path) as again:
        xr.testing.assert_equal(again["speed"], arrays["speed"])


def test_what_cannot_be_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ChoiceError, match='unknown table "trial"; did you mean "tri'):
        to_arrays(study("grid"), "trial")
    with pytest.raises(ChoiceError, match="no heatmaps are stored; record:"):
        to_arrays(study("grid"), "heatmaps")
    monkeypatch.setattr(netcdf, "find_spec", lambda _: None)
    with pytest.raises(ChoiceError) as error:
        to_arrays(study("grid"))
    assert 'pip install "boidsweep[netcdf]"' in str(error.value)
