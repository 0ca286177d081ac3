"""Maps of a spec's own: what is drawn or read is where it should be, and what cannot be
is refused.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from PIL import Image

from kernels.models import MODELS
from kernels.shapes import Polygon
from kernels.worlds import MAPS, build_reach, inside_any
from sweep.campaigns.launching import launch
from sweep.design.design import expand
from sweep.design.jobs import Jobs, point_id
from sweep.errors import SpecError, StoreError
from sweep.own_code.reading import load_spec
from sweep.replays.replaying import replay
from sweep.spec import copied_maps, images, maps
from sweep.spec.images import obstacles_of, rectangles
from sweep.spec.maps import OwnMap, from_json
from sweep.spec.settings import settings_of
from sweep.spec.strict_yaml import dump
from sweep.spec.study import Study, parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.trial.simulation import Simulation
from sweep.trial.world import world_of
from sweep.workers.executors import Serial
from tests import builders
from tests.design.test_senses import REMEMBERS
from tests.specs import short, short_study
from tests.studies import SMALL

ROOM = [
    "maps:",
    "  room:",
    "    size: [400, 300]",
    "    shapes:",
    "      - disc: {x: 100, y: 50, radius: 20}",
    "      - rectangle: {x: 300, y: 200, width: 40, height: 10}",
]
ROOM_OBSTACLES = ((100.0, 50.0, 20.0, 20.0, 1.0), (300.0, 200.0, 20.0, 5.0, 0.0))


def inside(
    obstacles: np.ndarray, size: tuple[float, float], x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Whether each point lies strictly inside an obstacle, as the kernels see it."""
    world = builders.a_world(*size, obstacles=obstacles)
    contact = build_reach(world, 0.0)
    return np.array(
        [
            inside_any(world, contact, *point)
            for point in zip(x.flat, y.flat, strict=True)
        ]
    ).reshape(x.shape)


PIXELS = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, max_side=12))


@settings(deadline=None)
@given(PIXELS)
def test_rectangles_cover_each_occupied_pixel_once(occupied: np.ndarray) -> None:
    count = np.zeros(occupied.shape, int)
    for left, top, right, bottom in rectangles(occupied):
        count[top:bottom, left:right] += 1
    assert (count == occupied).all()


@settings(deadline=None)
@given(PIXELS, st.sampled_from([0.05, 1.0, 37.3, 1e-4]))
def test_the_kernels_see_the_pixels_of_an_image_without_seams(
    occupied: np.ndarray, resolution: float
) -> None:
    rows, columns = occupied.shape
    size = columns * resolution, rows * resolution
    obstacles = obstacles_of(occupied, resolution)
    row, column = np.indices(occupied.shape)
    assert (
        inside(obstacles, size, (column + 0.5) * resolution, (row + 0.5) * resolution)
        == occupied
    ).all()
    right = occupied[:, :-1] & occupied[:, 1:]
    row, column = np.nonzero(right)
    assert inside(
        obstacles, size, (column + 1) * resolution, (row + 0.5) * resolution
    ).all()
    row, column = np.nonzero(right[:-1] & right[1:])
    assert inside(
        obstacles, size, (column + 1) * resolution, (row + 1) * resolution
    ).all()


def test_rectangles_are_few() -> None:
    frame = np.ones((50, 40), bool)
    frame[1:-1, 1:-1] = False
    assert rectangles(frame).tolist() == [
        [0, 1, 1, 49],
        [0, 0, 40, 1],
        [0, 49, 40, 50],
        [39, 1, 40, 49],
    ]
    assert len(rectangles(np.ones((4096, 4096), bool))) == 1
    assert rectangles(np.zeros((3, 4), bool)).shape == (0, 4)


def test_shapes_are_obstacles_and_bring_their_size() -> None:
    study = short_study(*ROOM, "fixed: {map: room}")
    assert study.maps["room"] == OwnMap((400.0, 300.0), ROOM_OBSTACLES)
    point = expand(study).settings(0)
    assert (point["map"], point["width"], point["height"]) == ("room", 400.0, 300.0)
    job, _ = Jobs(study, expand(study))
    assert job.obstacles == ROOM_OBSTACLES


def test_a_map_goes_wherever_a_map_goes() -> None:
    study = short_study(
        *ROOM,
        "sweep: {map: [empty, room], n: {values: [3, 4], when: \"map == 'room'\"}}",
        "require: [width > 0]",
    )
    design = expand(study)
    assert design.columns["map"].tolist() == ["empty", "room", "room"]
    assert design.columns["width"].tolist() == [1280.0, 400.0, 400.0]
    assert [job.obstacles for job in Jobs(study, design)[::2]] == [
        None,
        ROOM_OBSTACLES,
        ROOM_OBSTACLES,
    ]


def points(study: Study) -> list[str]:
    return Jobs(study, expand(study)).points


def test_points_stand_for_a_maps_content_and_those_of_built_in_maps_stay() -> None:
    swept = "sweep: {map: [empty, room, cafeteria]}"
    study = short_study(*ROOM, swept)
    empty, room, cafeteria = points(study)
    assert [empty, cafeteria] == points(short_study("sweep: {map: [empty, cafeteria]}"))
    moved = [line.replace("x: 100", "x: 100.5") for line in ROOM]
    assert points(short_study(*moved, swept))[0::2] == [empty, cafeteria]
    assert points(short_study(*moved, swept))[1] != room
    assert points(short_study(*ROOM, "fixed: {map: room}")) == [room]
    assert (
        point_id(
            "nguyen2024",
            "as_run",
            expand(study).settings(1),
            study.preset_settings,
            study.maps,
        )
        == room
    )


def write_image(path: Path, grey: np.ndarray) -> np.ndarray:
    Image.fromarray(grey).save(path)
    return grey


def loaded(folder: Path, *lines: str) -> Study:
    (folder / "spec.yaml").write_text(short("maps:", *lines))
    return load_spec(folder / "spec.yaml")


def test_an_image_keeps_its_orientation_and_dark_is_occupied(tmp_path: Path) -> None:
    grey = write_image(
        tmp_path / "lab.png", np.array([[255, 128, 127], [0, 255, 255]], np.uint8)
    )
    lab = loaded(tmp_path, "  lab: {image: lab.png, resolution: 0.05}").maps["lab"]
    assert lab.size == pytest.approx((0.15, 0.1))
    row, column = np.indices(grey.shape)
    assert (
        inside(
            np.array(lab.obstacles), lab.size, (column + 0.5) * 0.05, (row + 0.5) * 0.05
        )
        == (grey < 128)
    ).all()
    assert from_json(lab.as_json()) == lab


def occupied(path: Path) -> list[list[bool]]:
    return (images.brightness(path) < 127.5).tolist()


def test_images_of_other_kinds_mean_the_same(tmp_path: Path) -> None:
    grey = np.array([[255, 128, 127], [0, 255, 255]], np.uint8)
    expected = (grey < 128).tolist()
    clear = np.dstack(
        [np.zeros((2, 3, 3), np.uint8), np.where(grey < 128, 255, 0).astype(np.uint8)]
    )
    write_image(tmp_path / "deep.png", grey.astype(np.uint16) * 257)
    write_image(tmp_path / "clear.png", clear)
    write_image(tmp_path / "deep.pgm", grey.astype(np.uint16) * 257)
    write_image(tmp_path / "colour.png", np.dstack([grey] * 3))
    write_image(tmp_path / "grey.pgm", grey)
    Image.fromarray(grey).convert("P").save(tmp_path / "palette.png")
    Image.fromarray(grey < 128).convert("1").save(tmp_path / "bits.png")
    for name in (
        "deep.png",
        "deep.pgm",
        "clear.png",
        "colour.png",
        "grey.pgm",
        "palette.png",
    ):
        assert occupied(tmp_path / name) == expected, name
    assert occupied(tmp_path / "bits.png") == (grey >= 128).tolist()


ROS = (
    "image: floor.pgm\nresolution: 0.1\norigin: [-1.0, 2.5, 0.0]\nnegate:"
    " {}\noccupied_thresh: {}\nfree_thresh: 0.196\n"
)


@pytest.mark.parametrize(
    ("negate", "threshold", "expected"),
    [
        (0, 0.65, [True, True, False, False]),
        (0, 0.66, [True, False, False, False]),
        (1, 0.65, [False, False, False, True]),
    ],
)
def test_ros_maps_are_occupied_beyond_their_threshold(
    tmp_path: Path, negate: int, threshold: float, expected: list[bool]
) -> None:
    """Of a value v the occupancy is (255 - v) / 255, or v / 255 if negated: 88 stands
    for 0.655, 205 is unknown.
    """
    (tmp_path / "world").mkdir()
    write_image(
        tmp_path / "world" / "floor.pgm",
        np.array([[0, 88, 140, 205 if not negate else 254]], np.uint8),
    )
    (tmp_path / "world" / "floor.yaml").write_text(ROS.format(negate, threshold))
    floor = loaded(tmp_path, "  floor: {ros: world/floor.yaml}").maps["floor"]
    assert floor.size == pytest.approx((0.4, 0.1))
    x = np.array([0.05, 0.15, 0.25, 0.35])
    assert (
        inside(
            np.array(floor.obstacles).reshape(-1, 5), floor.size, x, np.full(4, 0.05)
        ).tolist()
        == expected
    )


def test_a_ros_map_may_leave_out_what_has_a_default(tmp_path: Path) -> None:
    write_image(tmp_path / "floor.pgm", np.array([[0, 88, 90, 205]], np.uint8))
    (tmp_path / "floor.yaml").write_text("image: floor.pgm\nresolution: 1\n")
    floor = loaded(tmp_path, "  floor: {ros: floor.yaml}").maps["floor"]
    assert [(x, round(half, 6)) for x, _, half, _, _ in floor.obstacles] == [(1.0, 1.0)]


def shapes(*lines: str) -> list[str]:
    return [
        "  room:",
        "    size: [10, 20]",
        "    shapes:",
        *(f"      - {line}" for line in lines),
    ]


MISTAKES = [
    (
        ["  cafeteria: {image: x.png, resolution: 1}"],
        '7: "cafeteria" is a built-in map: choose a different',
    ),
    (
        ["  Room: {image: x.png, resolution: 1}"],
        '7: map "Room" is not allowed: a name has lower-case letters',
    ),
    (["  room: {image: x.png}"], '7: missing key "resolution" in "room"'),
    (["  room: {img: x.png}"], '7: unknown key "img"'),
    (["  room: {size: [1, 2]}"], '7: "room" needs one of shapes, from, image, ros'),
    (
        ["  room: {image: x.png, ros: x.yaml}"],
        '7: "room" needs one of shapes, from, image, ros',
    ),
    (["  room: {image: x.png, resolution: 1, size: [1, 2]}"], '7: unknown key "size"'),
    (["  room: 5"], '7: "room" must be a mapping with at least one entry, not 5'),
    (
        ["  room: {image: none.png, resolution: 1}"],
        '7: the image "none.png" does not exist',
    ),
    (
        ["  room: {image: text.png, resolution: 1}"],
        '7: the image "text.png" is not an image; allowed: PNG,',
    ),
    (
        ["  room: {image: broken.png, resolution: 1}"],
        '7: the image "broken.png" cannot be read: ',
    ),
    (
        ["  room: {image: wide.png, resolution: 1}"],
        '7: the image "wide.png" has 4097 x 1 pixels; at most 4096 x 4096',
    ),
    (
        ["  room: {image: bomb.png, resolution: 1}"],
        '7: the image "bomb.png" is too large; at most 4096 x 4096 pixels',
    ),
    (
        ["  room: {image: noise.png, resolution: 1}"],
        '7: the image "noise.png" needs 8 rectangles; at most 7 are',
    ),
    (
        ["  room: {image: noise.png, resolution: 0}"],
        '7: "resolution" must be a number above 0, at most 1e+09, not 0',
    ),
    (
        ["  room: {image: noise.png, resolution: .inf}"],
        '7: "resolution" must be a finite number, not inf',
    ),
    (["  room: {ros: none.yaml}"], '7: there is no file "none.yaml" in '),
    (
        ["  room: {ros: empty.yaml}"],
        '7: "empty.yaml" is not a ROS map: the key "image" is missing',
    ),
    (
        ["  room: {ros: short.yaml}"],
        '7: "short.yaml" is not a ROS map: the key "resolution" is missing',
    ),
    (
        ["  room: {ros: scale.yaml}"],
        'scale.yaml:3: unknown mode "scale". Allowed: trinary',
    ),
    (
        ["  room: {ros: percent.yaml}"],
        'percent.yaml:3: "occupied_thresh" must be a number from 0 to 1, not 65',
    ),
    (
        ["  room: {image: whole.pfm, resolution: 1}"],
        '7: the image "whole.pfm" has pixels of 32 bits, without a',
    ),
    (["  room: {image: ., resolution: 1}"], '7: the image "." is a folder'),
    (
        ["  room: {size: [1], shapes: []}"],
        '7: "size" must be [width, height], not a list',
    ),
    (shapes(), '9: "shapes" must be a list, not an empty value'),
    (shapes("disc: {x: 1, y: 1}"), '10: missing key "radius" in "disc"'),
    (shapes("disk: {x: 1, y: 1}"), '10: unknown key "disk"; did you mean "disc"?'),
    (
        shapes("disc: {x: 1, y: 1, radius: -1}"),
        '10: "radius" must be a number above 0, at most 1e+09, not -1',
    ),
    (
        shapes("disc: {x: .nan, y: 1, radius: 1}"),
        '10: "x" must be a finite number, not nan',
    ),
    (
        shapes("disc: {x: 1, y: 1, radius: 1}", "disc: {x: -1, y: -1, radius: 1.4}"),
        "11: the disc is outside the",
    ),
    (
        shapes("rectangle: {x: 11, y: 5, width: 2, height: 2}"),
        "10: the rectangle is outside the world, which is 10 x 20",
    ),
    (
        shapes("{disc: {x: 1, y: 1, radius: 1}, rectangle: {x: 1}}"),
        "10: a shape needs exactly one of disc, rectangle and polygon",
    ),
    (
        shapes("polygon: {vertices: [[1, 1], [2, 2]]}"),
        '10: "vertices" must be a list of 3 to 1000 vertices [x, y], not a list of 2',
    ),
    (
        shapes("polygon: {vertices: [[1, 1], [2, 2], [.inf, 1]]}"),
        "10: ",
    ),
    (
        shapes("polygon: {vertices: [[1, 1], [3, 3], [3, 1], [1, 3]]}"),
        "10: the polygon has sides that cross: side 1, from (1, 1) to (3, 3), and side"
        " 3, from (3, 1) to (1, 3)",
    ),
    (
        shapes("polygon: {vertices: [[1, 1], [2, 2], [3, 3]]}"),
        "10: the polygon has the area 0: all vertices are on one line",
    ),
    (
        shapes("polygon: {vertices: [[-5, 1], [-1, 2], [-3, 3]]}"),
        "10: the polygon is outside the world, which is 10 x 20",
    ),
    (
        shapes("polygon: {vertices: [[1, 1], [3, 1], [1, 3]], solid: outsides}"),
        '10: unknown side "outsides"; did you mean "outside"?',
    ),
    (
        shapes(
            "polygon: {vertices: [[1, 1], [3, 1], [1, 3]], solid: outside, velocity:"
            " [1, 0]}"
        ),
        "10: an arena cannot move: remove velocity",
    ),
    (
        shapes("disc: {x: 1, y: 1, radius: 1, velocity: 3}"),
        '10: "velocity" must be',
    ),
    (
        shapes(*["disc: {x: 1, y: 1, radius: 1}"] * 8),
        '7: "room" has 8 shapes; at most 7 are allowed',
    ),
]


@pytest.mark.parametrize(
    ("lines", "message"), MISTAKES, ids=[" ".join(lines)[-60:] for lines, _ in MISTAKES]
)
def test_mistake_is_named_with_its_line(
    lines: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(maps, "MOST_SHAPES", 7)
    (tmp_path / "text.png").write_text("not an image")
    write_image(tmp_path / "wide.png", np.zeros((1, 4097), np.uint8))
    write_image(tmp_path / "noise.png", np.array([[0, 255] * 8], np.uint8))
    (tmp_path / "broken.png").write_bytes((tmp_path / "noise.png").read_bytes()[:45])
    (tmp_path / "empty.yaml").write_text("# nothing\n")
    (tmp_path / "short.yaml").write_text("image: noise.png\n")
    (tmp_path / "scale.yaml").write_text(
        "image: noise.png\nresolution: 1\nmode: scale\n"
    )
    (tmp_path / "percent.yaml").write_text(
        "image: noise.png\nresolution: 1\noccupied_thresh: 65\n"
    )
    (tmp_path / "whole.pfm").write_bytes(b"Pf\n2 2\n-1.0\n" + bytes(16))
    if "bomb" in lines[0]:
        write_image(tmp_path / "bomb.png", np.zeros((30, 30), np.uint8))
        monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 800)
    with pytest.raises(SpecError) as error:
        loaded(tmp_path, *lines)
    assert str(error.value).startswith(
        message if ".yaml" in message[:13] else f"spec.yaml:{message}"
    )


def test_a_size_that_contradicts_the_map_is_refused() -> None:
    with pytest.raises(
        SpecError, match="13: map room is 400 x 300 px: leave width and height out"
    ):
        expand(short_study(*ROOM, "fixed:", "  width: 401", "  map: room"))


@pytest.fixture
def in_metres(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A model measures in m; no later test meets its settings."""
    monkeypatch.setitem(MODELS, "nguyen2024", MODELS["nguyen2024"]._replace(length="m"))
    settings_of.cache_clear()
    yield
    settings_of.cache_clear()


@pytest.mark.usefixtures("in_metres")
def test_a_map_in_another_unit_than_the_model_is_refused() -> None:
    spec = parse_spec(short(*ROOM, "sweep:", "  map: [empty, room]"))
    assert expand(spec).n_points == 2
    with pytest.raises(SpecError) as error:
        expand(parse_spec(short(*ROOM, "sweep:", "  map: [empty, cafeteria]")))
    start = (
        "spec.yaml:13: map cafeteria is measured in px, but nguyen2024 in m; maps in m:"
        " empty, random_obstacles"
    )
    assert str(error.value).startswith(start)
    assert str(error.value).endswith('; or define custom shapes under "maps"')


IN_MAPS = SMALL.replace(
    "separation_weight: [0.5, 1]", "map: [room, lab, random_obstacles, cafeteria]"
)
IN_MAPS += "\n".join(ROOM) + "\n  lab: {image: lab.png, resolution: 10}\n"


@pytest.fixture
def stored(tmp_path: Path) -> StoredStudy:
    """A study on maps of all kinds, whose image has been deleted after its launch."""
    grey = np.full((30, 40), 255, np.uint8)
    grey[5:9, 6:20] = 0
    write_image(tmp_path / "lab.png", grey)
    (tmp_path / "spec.yaml").write_text(IN_MAPS)
    launch(load_spec(tmp_path / "spec.yaml"), tmp_path, Serial())
    (tmp_path / "lab.png").unlink()
    return StoredStudy("small", tmp_path)


def test_a_study_on_its_own_maps_replays_without_their_files(
    stored: StoredStudy,
) -> None:
    trials = stored.trials
    assert set(trials["status"]) == {"done"}
    assert list(trials["map"][::3]) == ["room", "lab", "random_obstacles", "cafeteria"]
    for trial in trials["trial_id"][::3]:
        report, same = replay(stored, trial)
        assert same, report


def test_the_world_of_a_trial_is_the_one_it_flew_in(stored: StoredStudy) -> None:
    room, lab, drawn, cafeteria = (
        stored.world(trial) for trial in stored.trials["trial_id"][::3]
    )
    assert (room.width, room.height) == (400.0, 300.0)
    assert tuple(map(tuple, room.obstacles)) == ROOM_OBSTACLES
    assert lab.obstacles == pytest.approx(np.array([[130.0, 70.0, 70.0, 20.0, 0.0]]))
    assert cafeteria.obstacles.shape == MAPS["cafeteria"].draw(None, None).shape
    study = parse_spec(
        SMALL.replace("separation_weight: [0.5, 1]", "map: [random_obstacles]")
    )
    job = next(job for job in Jobs(study, expand(study)) if job.replicate == 0)
    flown = Simulation(job).world
    assert (
        drawn.obstacles[:, :2] == np.column_stack([flown.obstacle_x, flown.obstacle_y])
    ).all()


def test_a_trial_whose_map_has_changed_since_is_not_replayed(
    stored: StoredStudy,
) -> None:
    trial = stored.trials["trial_id"][0]
    spec = SMALL.replace("separation_weight: [0.5, 1]", "map: [room]") + "\n".join(
        ROOM
    ).replace("x: 100", "x: 101")
    launch(parse_spec(spec), stored.store.folder.parent, Serial())
    with pytest.raises(
        StoreError,
        match="the last launched spec does not have the map room of this trial",
    ):
        replay(StoredStudy("small", stored.store.folder.parent), trial)


@pytest.mark.parametrize("metrics", [("speed",), ("coverage",)])
def test_worlds_kept_between_trials_are_those_of_their_obstacles(
    metrics: tuple[str, ...],
) -> None:
    """Two maps of one name and size follow each other in one process."""
    jobs = [
        replace(
            builders.job(
                n=3, steps=2, metrics=metrics, map="empty", width=100, height=90
            ),
            obstacles=obstacles,
        )
        for obstacles in (
            None,
            ((50.0, 45.0, 20.0, 10.0, 0.0),),
            ((50.0, 45.0, 20.0, 11.0, 0.0),),
        )
    ]
    assert [Simulation(job).world.half_height.tolist() for job in jobs * 2] == [
        [],
        [10.0],
        [11.0],
    ] * 2
    if metrics == ("coverage",):
        assert [
            Simulation(job).flight.record.coverage.traversable for job in jobs * 2
        ] == [
            9000,
            9000 - 39 * 19,
            9000 - 39 * 21,
        ] * 2


FIXED = sorted(copied_maps.sizes())


def copied(*lines: str) -> OwnMap:
    """The map "room" of a spec with these lines."""
    return short_study("maps:", "  room:", *lines).maps["room"]


def test_maps_that_are_the_same_in_every_trial_can_be_copied() -> None:
    for name in FIXED:
        size = MAPS[name].size
        assert size is not None
        drawn = np.array(copied_maps.obstacles_in(name))
        job = builders.job(
            "aziel_chen2025" if MAPS[name].unit == "px" else "nanobot", map=name
        )
        assert (drawn.reshape(-1, 5) == world_of(job).obstacles).all()
        own = copied(f"    from: {name}")
        assert own == OwnMap(size, copied_maps.obstacles_in(name))


def test_a_copied_map_has_what_is_changed_left_out_and_added() -> None:
    before = copied_maps.obstacles_in("cafeteria")
    own = copied(
        "    from: cafeteria",
        "    without: [18, 2]",
        "    change: [{number: 5, to: {disc: {x: 1, y: 2, radius: 3}}}]",
        "    add: [{rectangle: {x: 400, y: 300, width: 6, height: 8}}]",
    )
    other, new = (1.0, 2.0, 3.0, 3.0, 1.0), (400.0, 300.0, 3.0, 4.0, 0.0)
    assert own.obstacles == (*before[:1], *before[2:4], other, *before[5:17], new)


@settings(deadline=None)
@given(st.data())
def test_a_copy_is_written_shortly_and_gives_the_same_obstacles(data) -> None:
    name = data.draw(st.sampled_from(FIXED))
    size, obstacles = copied_maps.sizes()[name], [*copied_maps.obstacles_in(name)]
    number = st.floats(1.0, 9.0)  # within the smallest of them
    shape = st.builds(lambda x, y, r: (x, y, r, r, 1.0), number, number, number)
    for _ in range(data.draw(st.integers(0, 4))):
        place = data.draw(st.integers(0, len(obstacles)))
        kind = data.draw(st.sampled_from(["add", "move", "remove"]))
        if kind == "add" or place == len(obstacles):
            obstacles.append(data.draw(shape))
        elif kind == "move":
            obstacles[place] = data.draw(shape)
        else:
            del obstacles[place]
    own = OwnMap(size, tuple(obstacles))
    written = maps.map_as_written(own)
    text = dump({"room": written}).replace("\n", "\n  ")
    assert parse_spec(short("maps:", f"  {text}")).maps["room"] == own
    if len(obstacles) > 12:
        assert written["from"] == name
        assert len(text) < 600


def test_a_map_that_is_no_copy_is_written_with_its_shapes() -> None:
    own = OwnMap((800.0, 600.0), ROOM_OBSTACLES)
    assert maps.map_as_written(own).keys() == {"size", "shapes"}


def test_all_mistakes_of_a_copied_map_are_said_at_once() -> None:
    with pytest.raises(SpecError) as refused:
        copied(
            "    from: cafeteria",
            "    without: [19, 3]",
            "    change:",
            "    - {number: 3, to: {disc: {x: 1, y: 2, radius: 3}}}",
            "    - {number: 4, to: {disc: {x: 1, y: 2}}}",
            "    add: [{disc: {x: -90, y: 2, radius: 3}}]",
        )
    said = str(refused.value)
    for words in (
        "obstacle 3 is changed or left out twice",
        "there is no obstacle 19: cafeteria has 18",
        'missing key "radius"',
        "the disc is outside the world, which is 800 x 600",
    ):
        assert words in said, said
    with pytest.raises(SpecError, match='unknown map to copy "cafetera"; did you mean'):
        copied("    from: cafetera")
    with pytest.raises(SpecError, match='unknown map to copy "random_obstacles"'):
        copied("    from: random_obstacles")


SHAPES = [
    "      - polygon: {vertices: [[1, 1], [390, 1], [390, 290], [1, 290]],"
    " solid: outside}",
    "      - polygon:",
    "          vertices: [[50, 50], [90, 60], [60, 90.5]]",
    "          velocity: [1, -0.1]",
    "      - disc: {x: 200, y: 50, radius: 20, velocity: [0, 2]}",
]
OUTLINES = (
    *ROOM_OBSTACLES,
    Polygon(((1.0, 1.0), (390.0, 1.0), (390.0, 290.0), (1.0, 290.0)), True),
    Polygon(((50.0, 50.0), (90.0, 60.0), (60.0, 90.5)), False, (1.0, -0.1)),
    (200.0, 50.0, 20.0, 20.0, 1.0, 0.0, 2.0),
)


def test_polygons_and_velocities_are_read_written_and_stored_alike() -> None:
    room = parse_spec(short(*ROOM, *SHAPES)).maps["room"]
    assert room == OwnMap((400.0, 300.0), OUTLINES)
    stored = json.loads(json.dumps(room.as_json()))
    assert from_json(stored) == room
    written = dump({"maps": {"room": maps.map_as_written(room)}})
    assert parse_spec(short(written)).maps["room"] == room


def test_what_a_map_is_known_by_covers_shapes_and_velocities() -> None:
    """And is what it was where there are none."""
    plain = OwnMap((400.0, 300.0), ROOM_OBSTACLES)
    numbers = np.array(ROOM_OBSTACLES, "<f8").tobytes()
    assert plain.digest == sha256(numbers).hexdigest()[:32]
    still = OUTLINES[3]._replace(velocity=None)
    inside = OUTLINES[2]._replace(is_arena=False)
    found = {
        OwnMap((400.0, 300.0), (*OUTLINES[:2], *others)).digest
        for others in ((), OUTLINES[2:3], (inside,), OUTLINES[3:4], (still,))
    }
    assert len(found) == 5
    assert plain.digest in found


@pytest.mark.parametrize(
    ("obstacle", "words"),
    [
        ({"vertices": [[0, 0], [1, 1]]}, "a polygon has 2 vertices"),
        ({"vertices": [[0, 0], [1, 1], [2]]}, "no list of vertices"),
        ({"vertices": [[0, 0], [2, 2], [2, 0], [0, 2]]}, "sides that cross"),
        ({"vertices": [[0, 0], [1, 0], [1, "inf"]]}, "numbers beyond"),
        ({"vertices": [[0, 0], [1, 0], [1, 1]], "solid": "no"}, "numbers beyond"),
        (
            {"vertices": [[0, 0], [1, 0], [1, 1]], "velocity": [1]},
            "no list of vertices",
        ),
        ({"vertices": [[-9, 0], [-1, 0], [-1, 1]]}, "outside"),
        ([1, 2, 3, 4, 0, "nan", 1], "no table of obstacles"),
        ([1, 2, 3, 4, 0, 1], "no table of obstacles"),
    ],
)
def test_a_stored_map_that_is_none_is_refused(obstacle: object, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        from_json({"size": [10, 10], "obstacles": [obstacle]})


MOVES = [*ROOM, "      - disc: {x: 9, y: 9, radius: 5, velocity: [0, 1]}"]


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        (
            short(*MOVES, "fixed: {map: room}", "record: {metrics: [coverage]}"),
            "moving obstacles exclude counts of visits per pixel, because pixels are"
            " not always free: leave coverage out of `record`",
        ),
        (
            short("fixed: {obstacle_speed: 1}", "record: {heatmaps: true}"),
            "leave heatmaps out of `record`",
        ),
        (
            short(
                "fixed: {obstacle_speed: 1}",
                "record: {metrics: [speed]}",
            ).replace("nguyen2024", "rustamani2024"),
            "rustamani2024 looks at an occupancy grid of the start",
        ),
    ],
)
def test_obstacles_that_move_are_refused_where_they_mean_nothing(
    spec: str, words: str
) -> None:
    with pytest.raises(SpecError) as error:
        expand(parse_spec(spec))
    assert words in str(error.value)


def test_all_that_obstacles_that_move_may_not_is_said_at_once() -> None:
    """A grid of the start, and a way round the world within a step."""
    spec = short("fixed: {obstacle_speed: 99, dt: 1}", "record: {metrics: [speed]}")
    with pytest.raises(SpecError) as error:
        expand(parse_spec(spec.replace("nguyen2024", "rustamani2024")))
    assert "looks at an occupancy grid" in str(error.value)
    assert "an obstacle moves farther in one step" in str(error.value)


def test_a_model_that_does_not_publish_has_no_obstacles_that_move(
    tmp_path: Path,
) -> None:
    """It is told which line to change. Without motion it flies as before."""
    (tmp_path / "vortex.py").write_text(REMEMBERS, encoding="utf-8")
    path = tmp_path / "spec.yaml"
    text = (
        "study: my/a\nmodel: ./vortex.py\nfixed: {obstacle_speed: %d}\nreplicates: 1\n"
    )
    path.write_text(text % 0, encoding="utf-8")
    expand(load_spec(path))
    path.write_text(text % 1, encoding="utf-8")
    with pytest.raises(SpecError) as error:
        expand(load_spec(path))
    said = str(error.value)
    assert "spec.yaml:3: a moving obstacle needs a model that begins its steps" in said
    assert "write publish(flock, others, work) for remember(flock, others)" in said


@pytest.mark.parametrize(
    ("line", "fixed", "place"),
    [
        (MOVES[-1], "{map: room, dt: 1000}", "maps"),
        (MOVES[-1], "{map: room, obstacle_speed: 301, dt: 1}", "fixed"),
        (MOVES[-1], "{map: room, obstacle_speed: 1.0e308, dt: 1000}", "fixed"),
    ],
)
def test_an_obstacle_that_goes_round_the_world_in_a_step_is_refused(
    line: str, fixed: str, place: str
) -> None:
    lines = [*ROOM, line, f"fixed: {fixed}", "record: {metrics: [speed]}"]
    with pytest.raises(SpecError, match="moves farther in one step than the") as error:
        expand(parse_spec(short(*lines)))
    assert ("obstacle_speed needs" in str(error.value)) == (place == "fixed")


@pytest.mark.parametrize(
    ("velocity", "words"),
    [
        ("3", '"velocity" must be [x, y], not 3'),
        ("[1]", '"velocity" must be [x, y], not'),
        ("[1, .nan]", '"velocity" must be a finite number, not nan'),
        (
            "[1, 1.0e300]",
            '"velocity" must be a number from -1e+15 to 1e+15, not 1e+300',
        ),
    ],
)
def test_a_velocity_that_is_none_is_refused(velocity: str, words: str) -> None:
    line = f"      - disc: {{x: 9, y: 9, radius: 5, velocity: {velocity}}}"
    with pytest.raises(SpecError) as error:
        parse_spec(short(*ROOM, line))
    assert words in str(error.value)
