"""A replay at full resolution: every frame, the picture of one, an animation."""

import json
import subprocess
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from matplotlib.patches import Circle
from matplotlib.text import Text
from PIL import Image
from pyarrow import csv

import sweep.replays.flight as flight
import sweep.replays.video as video
from sweep.cli.replay_files import ReplayFiles, check, show
from sweep.errors import ChoiceError, OutputError
from sweep.figures import BLUE, COLOURS
from sweep.replays.animation import Scene, frames_apart, write_animation, write_picture
from sweep.replays.flight import frames, shown_frames, write_flight
from sweep.tables.stored_study import StoredStudy
from sweep.trial.simulation import run
from tests import builders, oscillators
from tests.commands import sweep
from tests.studies import SMALL, launched

SPEC = SMALL.replace("every: 2", "every: 3, trajectories: true").replace(
    "n: 12,", "n: 12, n_obstacles: 3,"
)


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(SPEC, tmp_path_factory.mktemp("flown"))


@pytest.fixture(scope="module")
def trial(study: StoredStudy) -> str:
    return str(study.plan["trial_id"][1].as_py())


def silent(_done: int, _whole: int) -> None:
    """Says nothing of the progress."""


def test_every_frame_is_written_and_agrees_with_those_stored(
    study: StoredStudy, trial: str, tmp_path: Path
) -> None:
    show(study, trial, ReplayFiles(trajectory=tmp_path / "flight.parquet"))
    table = pq.read_table(tmp_path / "flight.parquet")
    assert table["frame"].to_pylist() == list(range(10))
    steps, stored = study.trajectory(trial)
    assert steps.tolist() == [0, 3, 6, 9]
    for row, name in enumerate(("x", "y", "vx", "vy")):
        written = np.stack(table[name].to_pylist())
        assert (
            written[steps].tobytes() == np.ascontiguousarray(stored[:, row]).tobytes()
        )
    assert table.schema.field("x").metadata == {b"unit": b"px", b"text": b"positions"}
    about = json.loads(table.schema.metadata[b"boidsweep"])
    assert (about["trial"], about["spec"]) == (trial, study.spec)
    assert about["run_again"]["cpu"]


@pytest.fixture
def few_steps_a_call(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred for 40 boids: as many as for 2000 without."""
    monkeypatch.setattr(flight, "BOID_STEPS_A_CALL", 4000)


@pytest.mark.usefixtures("few_steps_a_call")
def test_long_flights_are_written_block_by_block(tmp_path: Path) -> None:
    """With few steps a call there are many blocks, and the same frames."""
    a_job = builders.job(n=40, steps=450)
    blocks = [taken.steps for taken in frames(a_job, 7, silent)]
    assert len(blocks) > 4
    assert np.concatenate(blocks).tolist() == [*range(0, 450, 7), 450]
    place = tmp_path / "flight.parquet"
    assert write_flight(a_job, place, 7, {}, silent) == [place]
    assert pq.read_metadata(place).num_rows == 66


@pytest.mark.usefixtures("few_steps_a_call")
def test_progress_goes_from_step_to_step() -> None:
    said: list[tuple[int, int]] = []
    for _ in frames(
        builders.job(n=40, steps=300),
        100,
        lambda done, whole: said.append((done, whole)),
    ):
        pass
    assert said[-1] == (300, 300)
    assert said == sorted(said)
    assert len(said) > 2


def test_a_frame_shows_boids_obstacles_and_goal_in_their_places() -> None:
    """Where something is drawn, the pixel has its colour; the axes tell which pixel
    that is.
    """
    a_job = builders.job(
        "rustamani2024",
        map="empty",
        obstacle_radius=0.5,
        n=1,
        width=10,
        height=10,
        goal_x=9,
        goal_y=9,
    )
    a_job = replace(a_job, obstacles=((3.0, 6.0, 1.0, 1.0, 1.0),))
    scene = Scene("test", a_job)
    picture = scene.draw(0, np.array([[5.0], [2.0], [1.0], [0.0]]))

    def colour(x: float, y: float) -> list[int]:
        column, up = scene.axes.transData.transform((x, y))
        return picture[round(picture.shape[0] - up), round(column)].tolist()

    boid = list(bytes.fromhex(BLUE[1:]))
    assert colour(5.0, 2.0) == boid
    assert colour(3.0, 6.0) == [153, 153, 153]
    assert colour(7.0, 3.0) == [255, 255, 255]
    goal = colour(9.0, 9.0)
    assert goal[1] > goal[0] + 50
    later = scene.draw(1, np.array([[7.0], [3.0], [1.0], [0.0]]))
    assert (later != picture).any()
    assert not scene.axes.collections[1:]
    picture = later
    assert colour(7.0, 3.0) == boid
    assert colour(5.0, 2.0) == [255, 255, 255]


def test_goals_in_turn_are_drawn_with_their_numbers() -> None:
    """A cross and a circle each; one goal alone has no number."""
    about = {"map": "empty", "width": 10, "height": 10, "goal_x": 9, "goal_y": 9}
    places = [(9.0, 9.0), (2.0, 3.0), (4.0, 1.5)]
    for goals, numbers in (("2 3; 4 1.5", ["1", "2", "3"]), ("", [])):
        axes = Scene(
            "test", builders.job("rustamani2024", n=1, next_goals=goals, **about)
        ).axes
        drawn = [text.get_text() for text in axes.texts]
        assert [one for one in drawn if one.isdigit()] == numbers
        circles = [one for one in axes.patches if isinstance(one, Circle)]
        assert [one.center for one in circles] == places[: len(numbers) or 1]


def test_obstacles_that_move_are_drawn_anew_in_each_frame() -> None:
    """Where they are after the steps of the frame, and nowhere else."""
    a_job = builders.job(map="empty", n=1, width=100, height=100, borders="bounded")
    disc = 20.0, 50.0, 8.0, 8.0, 1.0, 3.0, 0.0
    scene = Scene("test", replace(a_job, obstacles=(disc,)))
    grey, white = [153, 153, 153], [255, 255, 255]
    for step, x in ((0, 20.0), (20, 80.0), (5, 35.0)):
        picture = scene.draw(step, np.array([[50.0], [90.0], [1.0], [0.0]]))
        for place in (20.0, 35.0, 80.0):
            column, up = scene.axes.transData.transform((place, 50.0))
            found = picture[round(picture.shape[0] - up), round(column)].tolist()
            assert found == (grey if place == x else white)


def test_visited_pixels_are_shown_where_coverage_is_recorded() -> None:
    """One boid in a row of its own; the picture has the colour on its way alone, the
    title the share, and obstacles stay as they are.
    """
    metrics = ("coverage",)
    a_job = builders.job("aziel_chen2025", metrics=metrics, n=3, steps=40)
    found = list(shown_frames(a_job, 10, silent))
    assert [one.step for one in found] == [0, 10, 20, 30, 40]
    visits = found[-1].visits
    assert visits is not None
    assert (visits < 0).any()
    whole = run(replace(a_job, record=replace(a_job.record, heatmaps=True)))
    assert np.array_equal(visits, whole.heatmap)
    scene = Scene("test", a_job)
    picture = scene.draw(*found[-1])
    assert f"coverage {whole.last['coverage']:.1f} %" in scene.title.get_text()
    plain = Scene("test", a_job).draw(40, found[-1].bodies)
    changed = (picture != plain).any(axis=2)
    pixels = np.argwhere(visits > 0)
    places = scene.axes.transData.transform(pixels[:, ::-1])
    rows = np.rint(picture.shape[0] - places[:, 1]).astype(int)
    columns = np.rint(places[:, 0]).astype(int)
    assert changed[rows.clip(0, len(picture) - 1), columns].mean() > 0.8
    far = np.ones_like(changed)
    far[rows.clip(0, len(picture) - 1), columns] = False
    for _ in range(3):
        far[1:-1, 1:-1] &= far[:-2, 1:-1] & far[2:, 1:-1]
        far[1:-1, 1:-1] &= far[1:-1, :-2] & far[1:-1, 2:]
    below = scene.axes.bbox.y1
    shown = far[round(picture.shape[0] - below) :]
    assert not (changed[round(picture.shape[0] - below) :] & shown).any()


def test_a_trial_without_coverage_shows_no_visits() -> None:
    a_job = builders.job("nguyen2024", n=2, steps=4, metrics=("speed",))
    assert [one.visits for one in shown_frames(a_job, 2, silent)] == [None] * 3


def test_kinds_have_colours_of_their_own_and_a_legend() -> None:
    with builders.entered(oscillators.MODEL):
        a_job = builders.job("oscillators", metrics=(), n=2, pacemakers=1)
        scene = Scene("test", a_job)
    assert [text.get_text() for text in scene.axes.get_legend().get_texts()] == [
        "1 pacemaker",
        "1 follower",
    ]
    places = np.array([[50.0, 120.0], [40.0, 90.0], [1.0, 1.0], [0.0, 0.0]])
    picture = scene.draw(0, places)
    for (x, y), colour in zip(places[:2].T, COLOURS, strict=False):
        column, up = scene.axes.transData.transform((x, y))
        found = picture[round(picture.shape[0] - up), round(column)]
        assert found.tolist() == list(bytes.fromhex(colour[1:]))
    assert Scene("test", builders.job(n=2)).axes.get_legend() is None


def test_every_frame_has_the_state_and_the_kinds_of_boids(tmp_path: Path) -> None:
    with builders.entered(oscillators.MODEL, order=oscillators.ORDER):
        study = launched(oscillators.SPEC, tmp_path)
        trial = str(study.plan["trial_id"][1].as_py())
        show(study, trial, ReplayFiles(trajectory=tmp_path / "flight.parquet"))
        written = pq.read_table(tmp_path / "flight.parquet")
        stored = study.read("trajectories", pa.array([trial]))
    assert written.column_names == stored.column_names
    assert written.column_names[6:] == ["phase", "frequency", "kind"]
    steps = stored["frame"].to_pylist()
    assert steps == [0, 2, 4, 6, 8, 9]
    for name in written.column_names[2:]:
        assert written.take(steps)[name].to_pylist() == stored[name].to_pylist()
        assert written.field(name).metadata == stored.field(name).metadata


def test_a_frame_says_its_number_its_time_and_who_is_outside() -> None:
    scene = Scene("test", builders.job("rustamani2024", n=2, steps=40))
    words = scene._words(12, np.array([[5.0, -1.0], [2.0, 0.5], [0, 0], [0, 0]]))
    assert words == "step 12 of 40, t = 1.2 s\n2 boids, 1 outside"
    pixels = Scene("test", builders.job("nguyen2024", n=2, steps=40))
    assert pixels._words(0, np.zeros((4, 2))) == "step 0 of 40\n2 boids"


def test_a_single_frame_is_a_column_of_a_journal_with_its_title_in_the_middle() -> None:
    """89 mm at 300 dpi, all text of 5 to 7 points, and no title beyond the edges."""
    scene = Scene("test", builders.job("aziel_chen2025", n=2, steps=100_000))
    picture = scene.draw(100_000, np.array([[5, -1], [2, 0], [0, 0], [0, 0]], float))
    assert picture.shape[1] == 1051
    assert scene.figure.get_suptitle() == ""
    title = scene.title.get_window_extent()
    axes = scene.axes.bbox
    assert (title.x0 + title.x1) / 2 == pytest.approx((axes.x0 + axes.x1) / 2)
    assert 0 < title.x0 < title.x1 < 1051
    assert title.y1 < picture.shape[0]
    sizes = [text.get_fontsize() for text in scene.figure.findobj(Text)]
    assert 5 <= min(sizes) <= max(sizes) <= 7


@pytest.mark.parametrize(
    ("steps", "apart"), [(1, 1), (599, 1), (600, 2), (3600, 7), (10**6, 1670)]
)
def test_an_animation_has_six_hundred_frames_at_most(steps: int, apart: int) -> None:
    assert frames_apart(builders.job(steps=steps)) == apart
    assert steps // apart + 1 + (steps % apart > 0) <= 601


def test_a_gif_has_a_picture_a_frame_and_the_same_bytes_again(
    study: StoredStudy, trial: str, tmp_path: Path
) -> None:
    job = study.job(study.trial(trial))
    for name in ("one.gif", "two.gif"):
        write_animation(study.name, job, tmp_path / name, 1, silent)
    assert (tmp_path / "one.gif").read_bytes() == (tmp_path / "two.gif").read_bytes()
    with Image.open(tmp_path / "one.gif") as gif:
        assert gif.n_frames == 10
        assert gif.info["duration"] == 40
        gif.seek(6)
        shown = np.asarray(gif.convert("RGB"), np.int64)
    bodies = np.concatenate([taken.bodies for taken in frames(job, 1, silent)])
    scene = Scene(study.name, job, every=1)
    drawn = [scene.draw(step, bodies[step]) for step in range(7)]
    assert np.abs(shown - drawn[-1]).mean() < 1.0


def test_an_animation_shows_whence_boids_come_and_how_fast_it_goes() -> None:
    """Not across the border of a torus."""
    job = builders.job("nguyen2024", n=1, n_obstacles=0, width=1000, height=1000)
    heights = [100.0, 300.0, 500.0, 900.0, 50.0]
    scene, alone = Scene("test", job, every=4), Scene("test", job)

    def grey(picture: np.ndarray, x: float, y: float) -> bool:
        column, up = scene.axes.transData.transform((x, y))
        near = picture[round(picture.shape[0] - up), round(column) + np.arange(-1, 2)]
        return bool(near.min() < 230)

    for step, y in enumerate(heights):
        bodies = np.array([[300.0], [y], [0.0], [1.0]])
        flown, still = scene.draw(4 * step, bodies), alone.draw(4 * step, bodies)
    assert [grey(flown, 300.0, y) for y in (200.0, 400.0, 700.0)] == [True] * 3
    assert not grey(flown, 300.0, 980.0)
    assert not grey(still, 300.0, 200.0)
    said = scene.figure.get_supxlabel()
    assert "; 100 steps per second, lines: the last 60" in said
    assert "second" not in alone.figure.get_supxlabel()


def test_the_picture_of_a_frame_is_that_frame(
    study: StoredStudy, trial: str, tmp_path: Path
) -> None:
    job = study.job(study.trial(trial))
    _, stored = study.trajectory(trial)
    for frame, index in ((0, 0), (6, 2), (9, 3)):
        write_picture(study.name, job, frame, tmp_path / f"{frame}.png", silent)
        with Image.open(tmp_path / f"{frame}.png") as image:
            assert (
                np.asarray(image) == Scene(study.name, job).draw(frame, stored[index])
            ).all()


def test_a_frame_after_the_divergence_is_not_there(tmp_path: Path) -> None:
    a_job = builders.job(
        n=30, steps=400, separation_weight=1e308, separation_range=1000.0
    )
    with pytest.raises(ChoiceError, match=r"diverged before frame 400"):
        write_picture("test", a_job, 400, tmp_path / "x.png", silent)
    assert list(tmp_path.iterdir()) == []
    write_animation("test", a_job, tmp_path / "x.gif", 1, silent)
    with Image.open(tmp_path / "x.gif") as gif:
        assert gif.n_frames == 1


@pytest.mark.skipif(
    not (video.shutil.which("ffmpeg") or video.find_spec("imageio_ffmpeg")),
    reason="no ffmpeg",
)
def test_an_mp4_can_be_decoded_and_has_all_frames(
    study: StoredStudy, trial: str, tmp_path: Path
) -> None:
    job = study.job(study.trial(trial))
    write_animation(study.name, job, tmp_path / "flight.mp4", 1, silent)
    command = [
        video.find_ffmpeg(),
        "-v",
        "error",
        "-i",
        str(tmp_path / "flight.mp4"),
        "-f",
        "rawvideo",
    ]
    decoded = subprocess.run(
        [*command, "-pix_fmt", "rgb24", "-"], capture_output=True, check=True
    ).stdout
    bodies = np.concatenate([taken.bodies for taken in frames(job, 1, silent)])
    scene = Scene(study.name, job, every=1)
    drawn = np.stack([scene.draw(step, bodies[step]) for step in range(10)])
    film = np.frombuffer(decoded, np.uint8).reshape(drawn.shape)
    assert np.abs(film.astype(np.int64) - drawn).mean() < 4.0


def test_without_ffmpeg_mp4_says_what_to_do(
    study: StoredStudy, trial: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video.shutil, "which", lambda _name: None)
    monkeypatch.setattr(video, "find_spec", lambda _name: None)
    with pytest.raises(
        OutputError,
        match=(
            r'MP4 needs ffmpeg, .* pip install "boidsweep\[video\]" installs'
            r" ffmpeg; a .gif does not need"
        ),
    ):
        check(study, trial, ReplayFiles(animation=tmp_path / "x.mp4"))


def test_an_ffmpeg_that_fails_is_quoted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "broken"
    broken.write_text("#!/bin/sh\necho no such codec >&2\nexit 3\n")
    broken.chmod(0o755)
    monkeypatch.setattr(video, "find_ffmpeg", lambda: str(broken))

    def pictures() -> Iterator[np.ndarray]:
        for _ in range(50):
            yield np.zeros((200, 200, 3), np.uint8)

    with (
        (tmp_path / "x.mp4").open("w+b") as file,
        pytest.raises(OutputError, match="ffmpeg cannot write the MP4: no such codec"),
    ):
        video.write_mp4(pictures(), file)


def test_an_mp4_has_a_comment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ffmpeg reads it from a file, in which five signs have a backslash before them:
    https://ffmpeg.org/ffmpeg-formats.html#Metadata-1.
    """
    told = tmp_path / "told"
    told.write_text(
        '#!/bin/sh\nfor last; do\ncase "$last" in */metadata) comment="${last#file:}"'
        ';; esac\ndone\ncat >/dev/null\ncat "$comment" > "${last#file:}"\n',
        encoding="utf-8",
    )
    told.chmod(0o755)
    monkeypatch.setattr(video, "find_ffmpeg", lambda: str(told))
    with (tmp_path / "x.mp4").open("w+b") as file:
        pictures = iter([np.zeros((2, 2, 3), np.uint8)])
        video.write_mp4(pictures, file, "a = 1; # ü\nb: \\")
    assert (tmp_path / "x.mp4").read_text(encoding="utf-8") == (
        ";FFMETADATA1\ncomment=a \\= 1\\; \\# ü\\\nb: \\\\\n"
    )


def test_an_mp4_is_written_where_it_will_be(
    study: StoredStudy, trial: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """ffmpeg is given a path to the new file, not one in TMPDIR, to be copied."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    writes = tmp_path / "writes"
    writes.write_text(
        '#!/bin/sh\nfor last; do :; done\ncat > "${last#file:}"\n', encoding="utf-8"
    )
    writes.chmod(0o755)
    monkeypatch.setattr(video, "find_ffmpeg", lambda: str(writes))
    job, place = study.job(study.trial(trial)), tmp_path / "flight.mp4"
    write_animation(study.name, job, place, 1, silent)
    first = Scene(study.name, job, every=1).draw(
        0, next(frames(job, 1, silent)).bodies[0]
    )
    assert place.read_bytes()[: first.nbytes] == first.tobytes()
    assert sorted(tmp_path.iterdir()) == [place, writes]


WRONG = [
    (ReplayFiles(trajectory=Path("x.txt")), 'unknown kind of file ".txt"'),
    (ReplayFiles(animation=Path("x.avi")), 'unknown kind of file ".avi"'),
    (ReplayFiles(picture=(3, Path("x.jpg"))), 'unknown kind of file ".jpg"'),
    (
        ReplayFiles(picture=(10, Path("x.png"))),
        "there is no frame 10; allowed: 0 to 9",
    ),
    (ReplayFiles(picture=(-1, Path("x.png"))), "there is no frame -1"),
    (ReplayFiles(animation=Path("no/folder/x.gif")), "there is no folder"),
]


@pytest.mark.parametrize(("wanted", "message"), WRONG)
def test_a_mistake_is_said_before_any_work(
    study: StoredStudy, trial: str, wanted: ReplayFiles, message: str
) -> None:
    with pytest.raises((ChoiceError, OutputError)) as error:
        check(study, trial, wanted)
    assert message in str(error.value)


def test_a_flight_in_csv_has_a_row_a_frame_and_boid(
    study: StoredStudy, trial: str, tmp_path: Path
) -> None:
    place = tmp_path / "flight.csv"
    wanted = ReplayFiles(trajectory=place, every=3)
    check(study, trial, wanted)
    written = show(study, trial, wanted)
    assert written == [place, tmp_path / "flight.csv.json"]
    flight = csv.read_csv(place).to_pandas()
    steps = [0, 3, 6, 9]
    assert list(flight) == ["trial_id", "frame", "boid", "x", "y", "vx", "vy"]
    assert set(flight["trial_id"]) == {trial}
    assert flight["boid"].tolist() == list(range(12)) * len(steps)
    assert flight["frame"].tolist() == np.repeat(steps, 12).tolist()
    taken = list(shown_frames(study.job(study.trial(trial)), 3, silent))
    bodies = np.concatenate([one.bodies for one in taken], axis=1)
    columns = flight[["x", "y", "vx", "vy"]].to_numpy(np.float64)
    assert columns.T.tobytes() == bodies.tobytes()
    about = json.loads(written[1].read_text())
    assert about["columns"]["x"]["unit"] == "px"
    assert about["provenance"]["trial"] == trial
    with pytest.raises(OutputError, match=r"flight\.csv: exists already"):
        check(study, trial, wanted)
    place.unlink()
    with pytest.raises(OutputError, match=r"flight\.csv\.json: exists already"):
        check(study, trial, wanted)


def test_the_command_writes_all_of_it(
    study: StoredStudy, trial: str, tmp_path: Path
) -> None:
    options = [
        "--trajectory",
        "a.parquet",
        "--animate",
        "a.gif",
        "--frame",
        "4",
        "a.png",
        "--every",
        "2",
    ]
    command = [
        "replay",
        "small",
        trial,
        *options,
        "--results",
        str(study.store.folder.parent),
    ]
    done = sweep(tmp_path, *command)
    assert done.returncode == 0, done.stderr
    assert (
        "bitwise identical to the stored values: trials, series, trajectories"
        in done.stdout
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "a.gif",
        "a.parquet",
        "a.png",
    ]
    assert pq.read_table(tmp_path / "a.parquet")["frame"].to_pylist() == [
        0,
        2,
        4,
        6,
        8,
        9,
    ]
    again = sweep(tmp_path, *command)
    assert again.returncode == 2
    assert again.stderr == "a.parquet: exists already; --force replaces it\n"
