"""Formats of files, which all give the frames of a table."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from sweep.errors import SpecError
from sweep.recordings import open_frames
from sweep.recordings.files import FORMATS
from sweep.spec import Study
from tests.recordings.tracks import study_of_tracks, written

TIMES = np.arange(5) / 10
X = np.array([[1.0, 2.0, 3.0, 4.0, 5.0], [5.0, 4.0, 3.0, 2.0, 1.0]])
Y = np.array([[2.0] * 5, [3.0] * 5])
NAMES = ["anna", "ben"]


def frames_of(study: Study) -> np.ndarray:
    (event,) = study.catalogue.models[study.model].events
    return np.array(open_frames(event))


def expected(folder: Path) -> np.ndarray:
    folder.mkdir()
    rows = [
        (name, TIMES[k], X[boid, k], Y[boid, k])
        for boid, name in enumerate(NAMES)
        for k in range(5)
    ]
    written(folder, rows)
    return frames_of(study_of_tracks(folder))


@pytest.mark.parametrize("keypoints", [False, True])
def test_netcdf_of_movement_is_read(keypoints: bool, tmp_path: Path) -> None:
    """Of keypoints the mean is the position."""
    position = np.stack([X.T, Y.T], axis=1)
    dims = ["time", "space", "individuals"]
    coordinates = {"time": TIMES, "space": ["x", "y"], "individuals": NAMES}
    array = xr.DataArray(position, coordinates, dims)
    if keypoints:
        array = xr.concat([array - 1.0, array + 1.0], "keypoints")
    xr.Dataset({"position": array}).to_netcdf(tmp_path / "tracks.nc")
    found = frames_of(study_of_tracks(tmp_path, {"files": ["*.nc"]}))
    np.testing.assert_array_equal(found, expected(tmp_path / "table"))


def test_netcdf_of_something_else_is_an_error(tmp_path: Path) -> None:
    xr.Dataset({"speed": ("time", TIMES)}).to_netcdf(tmp_path / "tracks.nc")
    with pytest.raises(SpecError, match="the file has no variable position"):
        study_of_tracks(tmp_path, {"files": ["*.nc"]})


def test_arrays_of_each_individual_are_read(tmp_path: Path) -> None:
    """TRex writes infinity where an individual was lost, and arrays of other length."""
    for boid, name in enumerate(NAMES):
        x = X[boid].copy()
        x[2] = np.inf
        np.savez(
            tmp_path / f"{name}.npz",
            **{"X#wcentroid": x, "Y#wcentroid": Y[boid], "time": TIMES},
            frame_segments=np.zeros((2, 2)),
            video_size=np.array([1024.0, 768.0]),
        )
    columns = {
        "individual": "FILE",
        "time": "time",
        "x": "X#wcentroid",
        "y": "Y#wcentroid",
    }
    section = {"files": ["*.npz"], "columns": columns, "gaps": 0.2}
    study = study_of_tracks(tmp_path, section)
    np.testing.assert_allclose(frames_of(study), expected(tmp_path / "table"))
    assert study.catalogue.models[study.model].events[0].name == "all"


def test_no_pickled_object_is_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", x=np.array([{}], dtype=object))
    with pytest.raises(SpecError, match=r"a\.npz cannot be read"):
        study_of_tracks(tmp_path, {"files": ["*.npz"]})


def test_clocks_and_a_file_per_individual_are_read(tmp_path: Path) -> None:
    """Collars that begin at different times."""
    clock = pd.Timestamp("2024-05-01 23:59:59.9") + pd.to_timedelta(TIMES, "s")
    for boid, name in enumerate(NAMES):
        kept = slice(boid, None)
        table = pd.DataFrame({"when": clock, "x": X[boid], "y": Y[boid]})
        table[kept].to_csv(tmp_path / f"{name}.csv", index=False)
    section = {"columns": {"individual": "FILE", "time": "when"}}
    study = study_of_tracks(tmp_path, section)
    found = frames_of(study)
    assert np.isnan(found[0, :, 1]).all()
    np.testing.assert_allclose(found[:, 0, 0], X[0])
    np.testing.assert_allclose(found[1:, 0, 1], X[1, 1:])
    for zone in ("Z", "+02:00"):
        folder = tmp_path / zone
        folder.mkdir()
        for name in NAMES:
            file = f"{name}.csv"
            text = (tmp_path / file).read_text(encoding="utf-8")
            lines = [line.replace(",", f"{zone},", 1) for line in text.splitlines()]
            lines[0] = "when,x,y"
            (folder / file).write_text("\n".join(lines), encoding="utf-8")
        zoned = frames_of(study_of_tracks(folder, section))
        np.testing.assert_array_equal(zoned, found)
    parquet = tmp_path / "parquet"
    parquet.mkdir()
    for boid, name in enumerate(NAMES):
        table = pd.DataFrame({"when": clock, "x": X[boid], "y": Y[boid]})
        table[boid:].to_parquet(parquet / f"{name}.parquet")
    again = study_of_tracks(parquet, {"files": ["*.parquet"], **section})
    np.testing.assert_array_equal(frames_of(again), found)


def test_the_guide_lists_all_formats() -> None:
    guide = Path(__file__).parents[2] / "docs" / "guide" / "recordings.md"
    text = guide.read_text(encoding="utf-8")
    for ending in FORMATS:
        assert f"`{ending}`" in text


def test_files_of_one_name_are_events_with_their_folders(tmp_path: Path) -> None:
    for session in ("monday", "tuesday"):
        (tmp_path / session).mkdir()
        written(tmp_path / session, [("a", k / 10, k, 1) for k in range(3)])
    study = study_of_tracks(tmp_path, {"files": ["*/tracks.csv"]})
    names = [event.name for event in study.catalogue.models[study.model].events]
    assert names == ["monday/tracks", "tuesday/tracks"]


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("content", [b"", b"\x00\xff damaged", b"PK\x03\x04 cut"])
def test_damaged_files_are_an_error(
    ending: str, content: bytes, tmp_path: Path
) -> None:
    (tmp_path / f"tracks{ending}").write_bytes(content)
    with pytest.raises(SpecError, match=r"tracks"):
        study_of_tracks(tmp_path, {"files": ["*"]})
