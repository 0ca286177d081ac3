"""Runs as files: pictures, animations, and the page that plays one from disk."""

import io
import xml.etree.ElementTree as Tree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import sweep.web.export as export
import sweep.web.flight as flights
from kernels.identity import kernels_sha
from sweep.errors import ChoiceError, OutputError, StoreError
from sweep.replays.animation import Scene
from sweep.spec.study import RecordSpec
from sweep.trial.simulation import simulate
from sweep.web.flight import KeptFlight, fly
from tests import builders

JOB = replace(
    builders.job("nguyen2024", n=12, steps=30, n_obstacles=3),
    trial_id="0123456789abcdef01234567",
)
STUDY = "some/study"


@pytest.fixture(scope="module")
def flight() -> KeptFlight:
    return fly(STUDY, JOB, ("speed", "polarization"))


def test_a_flight_has_the_bits_of_the_trial(flight: KeptFlight) -> None:
    names = ("speed", "polarization")
    result = simulate(
        replace(JOB, record=RecordSpec(names, names, 1, trajectories=True))
    )
    assert result.frames is not None
    assert result.trajectory is not None
    assert flight.steps.tolist() == result.frames.tolist() == list(range(31))
    assert flight.bodies.tobytes() == result.trajectory.tobytes()
    for name in names:
        assert flight.values[name].tobytes() == result.series[name].tobytes()


def test_a_flight_ends_where_it_is_told_to_whatever_a_kernel_call_takes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = fly(STUDY, JOB, every=4)
    assert whole.steps.tolist() == [0, 4, 8, 12, 16, 20, 24, 28, 30]
    for boid_steps, until in ((1, 17), (60, 17), (200_000, 17), (60, 30), (60, 0)):
        monkeypatch.setattr("sweep.replays.flight.BOID_STEPS_A_CALL", boid_steps)
        part = fly(STUDY, JOB, ("speed",), every=4, until=until)
        count = until // 4 + 1 + (until == 30)
        assert part.steps.tolist() == whole.steps[:count].tolist()
        assert part.bodies.tobytes() == whole.bodies[:count].tobytes()
        assert part.values["speed"].shape == (count,)


def test_a_flight_too_large_for_memory_has_fewer_frames(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(flights, "MOST_BYTES", 30 * 8 * (4 * 12 + 1) // 7)
    assert fly(STUDY, JOB).steps.tolist() == [0, 7, 14, 21, 28, 30]


def test_the_place_of_a_step_is_the_latest_frame_before_it() -> None:
    part = fly(STUDY, JOB, every=7)
    assert [part.place(step) for step in (0, 6, 7, 29, 30, 1000, -5)] == [
        0,
        0,
        1,
        4,
        5,
        5,
        0,
    ]


def test_a_png_is_the_scene_and_says_where_it_comes_from(flight: KeptFlight) -> None:
    file = export.draw_frame(STUDY, JOB, 20, flight.bodies[20], "png")
    assert (file.name, file.mime) == ("some-study-01234567-step-20.png", "image/png")
    with Image.open(io.BytesIO(file.content)) as image:
        assert (
            np.asarray(image) == Scene(STUDY, JOB).draw(20, flight.bodies[20])
        ).all()
        assert (image.info["Study"], image.info["Trial"]) == (STUDY, JOB.trial_id)
        assert image.info["kernels_sha"] == kernels_sha()
        assert image.width == 1051
        assert image.info["dpi"] == pytest.approx((300, 300), abs=0.01)


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_a_picture_has_the_same_bytes_again(flight: KeptFlight, kind: str) -> None:
    one, other = (
        export.draw_frame(STUDY, JOB, 3, flight.bodies[3], kind) for _ in range(2)
    )
    assert one == other
    assert (
        one.content != export.draw_frame(STUDY, JOB, 4, flight.bodies[4], kind).content
    )


def test_an_svg_has_a_shape_for_every_boid_and_its_origin(flight: KeptFlight) -> None:
    root = Tree.fromstring(
        export.draw_frame(STUDY, JOB, 20, flight.bodies[20], "svg").content
    )
    groups = root.iter("{http://www.w3.org/2000/svg}g")
    uses = [
        group
        for group in groups
        if str(group.get("id")).startswith(("PolyCollection", "FillBetweenPoly"))
    ]
    assert len(uses) == 1
    assert len(list(uses[0].iter("{http://www.w3.org/2000/svg}path"))) == 12
    words = "".join(root.itertext())
    assert (
        f"Study: {STUDY}; Trial: {JOB.trial_id}; Model: nguyen2024 as_run; kernels_sha:"
        f" {kernels_sha()}" in words
    )


def test_an_animation_has_the_frames_of_the_flight(
    flight: KeptFlight, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "MOST_FRAMES", 12)
    spec = "study: some/study  # ü; x = 1\n" + 300 * "fixed: {n: 12}\n"
    file = export.animate(flight, "gif", spec)
    name = "some-study-01234567-to-step-30.gif"
    assert (file.name, file.mime) == (name, "image/gif")
    with Image.open(io.BytesIO(file.content)) as gif:
        assert gif.n_frames == 11
        comment = gif.info["comment"].decode()
        assert comment.startswith(f"Study: {STUDY}\nTrial: {JOB.trial_id}\n")
        assert comment.endswith(f"Step: 30\nSpec: {spec}")
        gif.seek(4)
        shown = np.asarray(gif.convert("RGB"), np.int64)
    scene = Scene(STUDY, JOB, 3)
    drawn = [scene.draw(step, flight.bodies[step]) for step in range(0, 13, 3)]
    assert np.abs(shown - drawn[-1]).mean() < 1.0


def test_an_mp4_without_ffmpeg_is_refused_before_any_work(
    flight: KeptFlight, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing() -> str:
        raise StoreError("MP4 needs ffmpeg")

    monkeypatch.setattr(export, "find_ffmpeg", missing)
    monkeypatch.setattr(export, "Scene", None)
    with pytest.raises(StoreError, match="MP4 needs ffmpeg"):
        export.animate(flight, "mp4")


@pytest.mark.parametrize(
    ("most", "kept"), [(31, 31), (30, 16), (16, 16), (15, 11), (3, 3), (2, 2)]
)
def test_a_thinned_flight_keeps_the_first_and_the_last_frame(
    flight: KeptFlight, most: int, kept: int
) -> None:
    few = export.thinned(flight, most)
    assert len(few.steps) == len(few.bodies) == len(few.values["speed"]) == kept <= most
    assert (few.steps[0], few.steps[-1]) == (0, 30)
    assert set(np.diff(few.steps)[:-1].tolist()) <= {few.every}
    assert few.bodies.tobytes() == flight.bodies[few.steps].tobytes()


def test_a_flight_of_one_frame_is_refused(flight: KeptFlight) -> None:
    with pytest.raises(ChoiceError, match="use 2 or more"):
        export.thinned(flight, 1)


def test_a_file_is_saved_whole_under_its_ending_and_replaces_none(
    flight: KeptFlight, tmp_path: Path
) -> None:
    file = export.draw_frame(STUDY, JOB, 3, flight.bodies[3], "svg")
    file.save(tmp_path / "x.svg")
    assert (tmp_path / "x.svg").read_bytes() == file.content
    with pytest.raises(OutputError, match="exists already"):
        file.save(tmp_path / "x.svg")
    with pytest.raises(OutputError, match=r'unknown kind of file "\.png"'):
        file.save(tmp_path / "x.png")
    file.save(tmp_path / "x.svg", force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["x.svg"]
