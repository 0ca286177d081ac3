"""Frames of a recording: times, gaps, velocities, events, kinds and units."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.recordings import open_frames, tracks
from sweep.spec import Study
from tests.recordings.tracks import study_of_tracks, written

Rows = list[tuple[object, ...]]


def frames_of(study: Study, event: int = 0) -> np.ndarray:
    return np.array(open_frames(study.catalogue.models[study.model].events[event]))


def line(individual: str, times: list[int], speed: float = 2.0) -> Rows:
    """An individual on a line, at some tenths of a second."""
    return [(individual, time / 10, 1.0 + speed * time / 10, 5.0) for time in times]


def test_rows_in_any_order_of_individuals_become_frames(tmp_path: Path) -> None:
    rows = [*line("10", [0, 1, 2, 3]), *line("9", [0, 1, 2, 3], speed=1.0)]
    written(tmp_path, sorted(rows, key=lambda row: row[1]))
    frames = frames_of(study_of_tracks(tmp_path))
    assert frames.shape == (4, 4, 2)
    np.testing.assert_allclose(
        frames[:, 0], [[1, 1], [1.1, 1.2], [1.2, 1.4], [1.3, 1.6]]
    )
    np.testing.assert_allclose(frames[:, 2], np.tile([1.0, 2.0], (4, 1)))
    np.testing.assert_allclose(frames[:, 3], 0.0)


def test_times_begin_at_the_first_row_of_an_event(tmp_path: Path) -> None:
    """A clock that counts from 1970, to the millisecond."""
    rows = [("a", 1_700_000_000.123 + k / 10, k, 5.0) for k in range(4)]
    written(tmp_path, rows)
    frames = frames_of(study_of_tracks(tmp_path))
    assert frames[:, 0, 0].tolist() == [0, 1, 2, 3]


@pytest.mark.parametrize(
    ("gaps", "present"),
    [
        (0, [True, True, False, False, True, True]),
        (0.2, [True, True, False, False, True, True]),
        (0.3, [True] * 6),
    ],
)
def test_a_gap_is_filled_up_to_the_stated_time(
    gaps: float, present: list[bool], tmp_path: Path
) -> None:
    written(tmp_path, [*line("a", [0, 1, 4, 5]), *line("b", [0, 1, 2, 3, 4, 5])])
    study = study_of_tracks(tmp_path, {"gaps": gaps})
    frames = frames_of(study)
    assert np.isfinite(frames[:, 0, 0]).tolist() == present
    event = study.catalogue.models[study.model].events[0]
    filled = 2 if all(present) else 0
    assert event.interpolated == filled / 12
    assert event.absent == pytest.approx((6 - sum(present)) / 12)
    if filled:
        np.testing.assert_allclose(frames[:, 0, 0], 1.0 + 0.2 * np.arange(6))


def test_irregular_times_are_interpolated_linearly(tmp_path: Path) -> None:
    times = [0.0, 0.13, 0.21, 0.3, 0.42]
    written(tmp_path, [("a", time, time**2, 1.0) for time in times])
    study = study_of_tracks(tmp_path, {"gaps": 0.2, "origin": {"x": 0, "y": 0}})
    grid = np.arange(5) * 0.1
    expected = np.interp(grid, times, np.square(times))
    np.testing.assert_allclose(frames_of(study)[:, 0, 0], expected)
    assert study.catalogue.models[study.model].events[0].interpolated == 3 / 5


def test_no_frame_is_after_the_last_row(tmp_path: Path) -> None:
    times = [0.0, 0.1, 0.2, 0.28]
    written(tmp_path, [("a", time, time, 1.0) for time in times])
    frames = frames_of(study_of_tracks(tmp_path, {"gaps": 0.1}))
    assert len(frames) == 3
    assert np.isfinite(frames).all()


def test_a_projection_far_from_its_origin_gets_a_corner(tmp_path: Path) -> None:
    rows = [("a", k / 10, 500_000.5 + k, 6_200_000.0) for k in range(5)]
    written(tmp_path, rows)
    study = study_of_tracks(tmp_path)
    np.testing.assert_allclose(frames_of(study)[:, 0, 0], 0.5 + np.arange(5))
    assert study.preset_settings["width"] == 5.0


@pytest.mark.parametrize("scheme", ["central", "backward"])
def test_velocities_are_differences_of_the_stated_scheme(
    scheme: str, tmp_path: Path
) -> None:
    """The naive differences, one-sided at an end."""
    x = [0.0, 1.0, 4.0, 9.0, 16.0]
    written(tmp_path, [("a", k / 10, value, 2.0) for k, value in enumerate(x)])
    frames = frames_of(study_of_tracks(tmp_path, {"velocities": scheme}))
    expected = []
    for k in range(5):
        before = max(k - 1, 0)
        after = min(k + 1, 4) if scheme == "central" or k == 0 else k
        expected.append((x[after] - x[before]) / ((after - before) * 0.1))
    np.testing.assert_allclose(frames[:, 2, 0], expected)


def test_given_velocities_are_scaled_like_positions(tmp_path: Path) -> None:
    rows = [("a", k / 10, 100 * k, 200, 30.0, -40.0) for k in range(3)]
    written(tmp_path, rows, "id,t,x,y,u,v")
    columns = {"vx": "u", "vy": "v"}
    section = {"velocities": "given", "columns": columns, "scale": 0.01}
    frames = frames_of(study_of_tracks(tmp_path, section))
    np.testing.assert_allclose(frames[1, :, 0], [1.0, 2.0, 0.3, -0.4])


def test_each_file_or_each_value_of_a_column_is_an_event(tmp_path: Path) -> None:
    written(tmp_path, line("a", [0, 1, 2]), name="second.csv")
    written(tmp_path, [*line("a", [0, 1]), *line("b", [0, 1])], name="first.csv")
    study = study_of_tracks(tmp_path)
    events = study.catalogue.models[study.model].events
    shapes = [(event.name, event.boids, event.steps) for event in events]
    assert shapes == [("first", 2, 1), ("second", 1, 2)]
    for file in tmp_path.glob("*.csv"):
        file.unlink()
    rows = [(*row, drive) for drive in (10, 9) for row in line("a", [0, 1, 2])]
    written(tmp_path, rows, "id,t,x,y,drive")
    study = study_of_tracks(tmp_path, {"columns": {"event": "drive"}})
    events = study.catalogue.models[study.model].events
    assert [event.name for event in events] == ["9", "10"]
    assert events[0].sha == events[1].sha
    assert study.trials_per_point == 2


def test_kinds_come_in_order_and_are_counted(tmp_path: Path) -> None:
    rows = [
        (*row, kind)
        for name, kind in (("1", "Sheep"), ("2", "dog"), ("3", "sheep"))
        for row in line(name, [0, 1])
    ]
    written(tmp_path, rows, "id,t,x,y,species")
    study = study_of_tracks(tmp_path, {"columns": {"kind": "species"}})
    assert study.catalogue.models[study.model].kinds == ("dog", "sheep")
    assert study.preset_settings["count_dog"] == 1
    assert study.preset_settings["count_sheep"] == 2


def test_chosen_kinds_have_the_stated_order_and_others_are_left_out(
    tmp_path: Path,
) -> None:
    rows = [
        (*row, kind)
        for name, kind in (("1", "shepherd"), ("2", "dog"), ("3", "sheep"))
        for row in line(name, [0, 1], speed=float(name))
    ]
    rows += [(*row, "shepherd") for row in line("1", [2, 3, 4])]
    written(tmp_path, rows, "id,t,x,y,k")
    section = {"columns": {"kind": "k"}, "kinds": ["sheep", "dog"]}
    study = study_of_tracks(tmp_path, section)
    model = study.catalogue.models[study.model]
    assert model.kinds == ("sheep", "dog")
    assert model.events[0].kinds == (1, 1)
    assert model.events[0].steps == 1
    alone = study_of_tracks(tmp_path, section | {"kinds": ["dog"]})
    turned = study_of_tracks(tmp_path, section | {"kinds": ["dog", "sheep"]})
    frames = frames_of(study)
    np.testing.assert_array_equal(frames_of(turned), frames[..., ::-1])
    np.testing.assert_array_equal(frames_of(alone), frames[..., 1:])


def test_a_world_around_negative_positions_has_a_lower_corner(tmp_path: Path) -> None:
    written(tmp_path, [("a", k / 10, -2.5 + k, 3.2) for k in range(6)])
    study = study_of_tracks(tmp_path)
    np.testing.assert_allclose(frames_of(study)[:, 0, 0], 0.5 + np.arange(6))
    assert study.preset_settings["width"] == 6.0
    assert study.preset_settings["height"] == 4.0
    stated = study_of_tracks(tmp_path, {"origin": {"x": -10, "y": 1}})
    np.testing.assert_allclose(frames_of(stated)[0, :2, 0], [7.5, 2.2])


def test_parquet_files_have_the_frames_of_csv_files(tmp_path: Path) -> None:
    rows = [*line("a", [0, 1, 2]), *line("b", [0, 2])]
    file = written(tmp_path, rows)
    expected = frames_of(study_of_tracks(tmp_path))
    pd.read_csv(file).to_parquet(tmp_path / "tracks.parquet")
    found = frames_of(study_of_tracks(tmp_path, {"files": ["*.parquet"]}))
    assert found.tobytes() == expected.tobytes()


def test_columns_per_individual_have_the_frames_of_rows(tmp_path: Path) -> None:
    """As idtracker.ai writes them, and with names before x; a lost fish is a gap."""
    rows = [*line("1", [0, 1, 2]), *line("2", [0, 2], speed=3.0)]
    written(tmp_path, rows)
    expected = frames_of(study_of_tracks(tmp_path))
    wide = pd.DataFrame(rows, columns=["id", "time", "x", "y"])
    wide = wide.pivot_table(index="time", columns="id", values=["x", "y"])
    (tmp_path / "tracks.csv").unlink()
    for form, x, y in (
        ("{0}{1}", "x*", "y*"),
        ("fish {1}.{0}", "fish *.x", "fish *.y"),
    ):
        table = wide.set_axis([form.format(*name) for name in wide.columns], axis=1)
        table.reset_index().to_csv(tmp_path / "wide.csv", index=False)
        study = study_of_tracks(tmp_path, {"columns": {"time": "time", "x": x, "y": y}})
        assert frames_of(study).tobytes() == expected.tobytes()
        (event,) = study.catalogue.models[study.model].events
        assert event.individuals == ("1", "2")


def test_columns_per_individual_have_different_types(tmp_path: Path) -> None:
    """As those of an animal that is lost; a column `id` is of no individual."""
    table = {"id": [7, 8, 9], "t": [0.0, 0.1, 0.2], "x1": [1, 2, 3], "y1": [1, 1, 1]}
    table |= {"x2": [1.5, 2.5, None], "y2": [2.0, 2.0, None]}
    pd.DataFrame(table).to_parquet(tmp_path / "tracks.parquet")
    section = {"files": ["*.parquet"], "columns": {"x": "x*", "y": "y*"}}
    frames = frames_of(study_of_tracks(tmp_path, section))
    np.testing.assert_array_equal(frames[:, 0], [[1, 1.5], [2, 2.5], [3, np.nan]])


def test_rows_that_are_left_out_are_not_read(tmp_path: Path) -> None:
    rows = [*line("1", [0, 1]), *line("2", [0, 1])]
    broken = [(*row, "sheep" if row[0] == "1" else "dog") for row in rows]
    broken.append(("2", 0.2, "inf", "lost", "dog"))
    written(tmp_path, broken, "id,t,x,y,k")
    section = {"columns": {"kind": "k"}, "kinds": ["sheep"]}
    assert frames_of(study_of_tracks(tmp_path, section)).shape == (2, 4, 1)


def test_names_with_numbers_are_in_the_order_of_the_numbers(tmp_path: Path) -> None:
    names = ("s10", "s2", "10", "9", "s1b", "s1")
    written(tmp_path, [row for name in names for row in line(name, [0, 1])])
    study = study_of_tracks(tmp_path)
    (event,) = study.catalogue.models[study.model].events
    assert event.individuals == ("9", "10", "s1", "s1b", "s2", "s10")


def test_degrees_become_metres_around_the_first_position(tmp_path: Path) -> None:
    """A degree of latitude at the equator is 110.574 km on WGS 84, of longitude 111.320
    km; the reference tables have metres.
    """
    rows = [("a", 0, 10, 0), ("a", 0.1, 10.001, 0), ("a", 0.2, 10.001, 0.001)]
    written(tmp_path, rows)
    study = study_of_tracks(tmp_path, {"coordinates": "degrees", "scale": 0.001})
    frames = frames_of(study)[:, :2, 0]
    moved = frames - frames[0]
    expected = [[0, 0], [0.111320, 0], [0.111320, 0.110574]]
    np.testing.assert_allclose(moved, expected, atol=1e-6)


def test_a_moving_parabola_keeps_parabolas_and_smooths_noise(tmp_path: Path) -> None:
    """A mean of five values of a cubic filter has 17/35 of the variance of one. Runs
    between gaps are smoothed for themselves.
    """
    rng = np.random.default_rng(4)
    times = np.arange(2000)
    noise = rng.normal(0.0, 0.1, (2, times.size))
    rows = [("still", t / 10, 50 + u, 50 + v) for t, (u, v) in enumerate(noise.T)]
    rows += [("thrown", t / 10, 0.1 * t, (t / 100) ** 2) for t in times if t % 50 > 6]
    written(tmp_path, rows)
    raw = frames_of(study_of_tracks(tmp_path))
    frames = frames_of(study_of_tracks(tmp_path, {"smoothing": 0.4}))
    np.testing.assert_allclose(frames[:, :2, 1], raw[:, :2, 1], atol=1e-9)
    assert np.isnan(raw[:, 0, 1]).sum() == 7 * 40
    ratio = frames[2:-2, :2, 0].var() / raw[2:-2, :2, 0].var()
    assert ratio == pytest.approx(17 / 35, rel=0.1)
    np.testing.assert_allclose(
        frames[1:-1, 2, 0], (frames[2:, 0, 0] - frames[:-2, 0, 0]) / 0.2, atol=1e-12
    )


def test_tenths_of_many_rows_are_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    for name in "abc":
        written(tmp_path, line(name, [0, 1, 2, 3]), name=f"{name}.csv")
    section = {"columns": {"event": "FILE"}}
    study_of_tracks(tmp_path, section)
    assert caplog.messages == []
    monkeypatch.setattr(tracks, "MANY_ROWS", 11)
    study_of_tracks(tmp_path, section | {"gaps": 1})
    assert caplog.messages == [f"{share} % of 12 rows read" for share in (30, 60, 100)]


def test_missing_values_are_gaps(tmp_path: Path) -> None:
    rows = [("a", 0, 1, 1), ("a", 0.1, "NaN", ""), ("a", 0.2, 3, 1), ("b", 0, 1, 1)]
    written(tmp_path, [*rows, ("b", 0.1, 1, 1), ("b", 0.2, 1, 1)])
    frames = frames_of(study_of_tracks(tmp_path, {"gaps": 0.2}))
    np.testing.assert_allclose(frames[:, 0, 0], [1.0, 2.0, 3.0])


def test_other_delimiters_are_read(tmp_path: Path) -> None:
    text = "\n".join(";".join(map(str, row)) for row in line("a", [0, 1, 2]))
    (tmp_path / "t.csv").write_text(f"id;t;x;y\n{text}\n", encoding="utf-8")
    assert frames_of(study_of_tracks(tmp_path, {"delimiter": "semicolon"})).shape == (
        3,
        4,
        1,
    )
