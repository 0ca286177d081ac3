"""Settings that do not go together are refused, with the line and the values."""

from pathlib import Path

import pytest

from sweep.design.design import expand
from sweep.design.motors import LINE
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.study import parse_spec
from tests.studies import COVERING, SMALL


def refused(spec: str) -> str:
    """The message with which the design of `spec` is refused."""
    with pytest.raises(SpecError) as error:
        expand(parse_spec(spec))
    return str(error.value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ("start_margin: 370", "spec.yaml:5: start_margin leaves boids no room"),
        (
            "obstacle_margin: 371",
            "spec.yaml:5: obstacle_margin leaves obstacles no room",
        ),
        (
            (
                "start_radius: 9, start_center_x: 40, start_center_y: 30, start_draws:"
                " python_random"
            ),
            "spec.yaml:5: start_draws",
        ),
        (
            "start_radius: 9, start_center_x: -1",
            "spec.yaml:5: the centre of the start is outside the world",
        ),
        (
            "minimum_image: true, borders: open",
            "spec.yaml:5: minimum_image needs periodic boundaries",
        ),
    ],
)
def test_a_setting_without_room_is_refused(settings: str, message: str) -> None:
    assert refused(SMALL.replace("n: 12", f"n: 12, {settings}")).startswith(message)


def test_a_potential_needs_a_model_that_has_one() -> None:
    message = refused(SMALL.replace("series: [speed]", "series: [speed, potential]"))
    assert (
        message
        == 'spec.yaml:10: metric "potential" needs a model with a pair potential.'
        " Allowed: patel2023, nanobot"
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ("path_step: 0.5", "spec.yaml:5: no point of a path is looked at"),
        ("angle_step: 3.2", "spec.yaml:5: no other heading is looked at"),
        (
            "path_step: 0.001, look_ahead: 1e6",
            "spec.yaml:5: more than 1,000,000 places would be looked at",
        ),
        (
            "path_step: 0.001, angle_step: 0.001",
            "spec.yaml:5: more than 1,000,000 places would be looked at",
        ),
    ],
)
def test_steering_that_looks_at_nothing_or_without_end_is_refused(
    settings: str, message: str
) -> None:
    """Unless it has no weight."""
    spec = SMALL.replace("nguyen2024", "rustamani2024").replace(
        "n: 12", f"n: 12, {settings}"
    )
    assert refused(spec).startswith(message)
    expand(parse_spec(spec.replace("n: 12", "n: 12, obstacle_weight: 0")))


def test_a_potential_needs_cohesion_to_reach_as_far_as_separation() -> None:
    spec = SMALL.replace("nguyen2024", "nanobot").replace(
        "n: 12", "n: 12, separation_range: 41"
    )
    expand(parse_spec(spec.replace("series:", "metrics: [speed], series:")))
    assert refused(spec).startswith(
        "spec.yaml:5: the pair potential that is recorded needs a separation_range"
    )


def test_the_lower_limit_of_the_speed_is_not_above_the_upper() -> None:
    spec = SMALL.replace("nguyen2024", "nanobot").replace(
        "n: 12", "n: 12, min_speed: 7"
    )
    assert refused(spec).startswith(
        "spec.yaml:5: the lower limit of the speed is above the upper one where"
        " max_speed"
    )


def test_all_that_does_not_go_together_is_said_at_once() -> None:
    """Demands and senses; each in a sentence of its own."""
    fixed = (
        "sensing_delay: 0.5, occlusion: boids, motor_min_speed: 3, motor_max_speed: 1,"
        " start_margin: 1e9"
    )
    spec = "study: x\nmodel: vicsek1995\nreplicates: 1\nfixed: {" + fixed + "}\n"
    said = refused(spec).splitlines()
    assert [words.partition(": ")[2].split()[0] for words in said] == [
        *("start_margin", "motor_min_speed", "sensing_delay", "occlusion"),
    ]


def test_the_first_offending_point_of_a_sweep_is_named() -> None:
    spec = SMALL.replace("separation_weight: [0.5, 1]", "start_margin: [0, 500, 600]")
    assert "spec.yaml:7:" in refused(spec)
    assert "start_margin = 500.0" in refused(spec)


def test_what_comes_with_a_map_is_said_where_the_map_is_chosen() -> None:
    robots = SMALL.replace("n: 12", "n: 12, start_speed: 0").replace(
        "nguyen2024", "rustamani2024"
    )
    room = (
        "maps: {room: {size: [1, 1], shapes: [{disc: {x: 0, y: 0, radius:"
        " 0.1}}]}}\nseed: 5"
    )
    small = robots.replace("seed: 5", room).replace(
        "separation_weight: [0.5, 1]", "map: [arena, room]"
    )
    assert refused(small).startswith("spec.yaml:7: start_margin leaves boids no room")


def test_a_goal_outside_the_world_is_refused_where_it_is_recorded() -> None:
    robots = SMALL.replace("nguyen2024", "rustamani2024").replace(
        "n: 12", "n: 12, start_speed: 0, map: empty, height: 8"
    )
    assert "spec.yaml:5: the goal lies outside the world" in refused(robots)
    assert (
        expand(
            parse_spec(robots.replace("{series: [speed]", "{metrics: [speed]"))
        ).n_points
        == 2
    )
    assert (
        expand(parse_spec(robots.replace("height: 8", "height: 8, goal_y: 8"))).n_points
        == 2
    )


def test_a_world_smaller_than_a_pixel_is_refused_where_coverage_is_recorded() -> None:
    assert (
        "spec.yaml:5: coverage is counted by pixels, and the world has no room for one"
        " where height"
        in refused(COVERING.replace("steps: 20", "steps: 20, pixel: 601"))
    )
    assert (
        expand(
            parse_spec(COVERING.replace("steps: 20", "steps: 20, pixel: 600"))
        ).n_points
        == 2
    )


def test_a_world_of_too_many_pixels_is_refused_where_coverage_is_recorded() -> None:
    huge = "width: 100000, height: 100000"
    covering = COVERING.replace("map: cafeteria", f"map: empty, {huge}")
    assert "coverage is counted by pixels" in refused(covering)
    assert expand(parse_spec(SMALL.replace("n: 12", f"n: 12, {huge}"))).n_points == 2
    assert (
        expand(
            parse_spec(covering.replace("map: empty", "map: empty, pixel: 10"))
        ).n_points
        == 2
    )


@pytest.mark.parametrize(
    "settings",
    [
        "start_margin: 369",
        "obstacle_margin: 370",
        "minimum_image: true",
        "n_obstacles: 0, obstacle_margin: 999",
    ],
)
def test_what_just_fits_is_accepted(settings: str) -> None:
    assert (
        expand(parse_spec(SMALL.replace("n: 12", f"n: 12, {settings}"))).n_points == 2
    )


def test_an_occupancy_grid_of_too_many_cells_is_refused_if_the_model_has_one() -> None:
    robots = SMALL.replace("nguyen2024", "rustamani2024").replace(
        "n: 12", "n: 12, map: empty, width: 600, height: 41"
    )
    assert (
        "spec.yaml:5: the occupancy grid would have more than 10,000,000 cells"
        in refused(
            robots.replace("41", "42").replace("n: 12", "n: 12, grid_cell: 0.05")
        )
    )
    assert expand(parse_spec(robots)).n_points == 2


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            "motor_min_speed: 3, motor_max_speed: 2",
            "spec.yaml:5: motor_min_speed is above motor_max_speed",
        ),
        (
            "failing_share: 0.2, failing_time: 1e6",
            "spec.yaml:5: failing_time is not before the end of a trial",
        ),
        ("motor_turn_rate: 0", "spec.yaml:5: 0 is not allowed for motor_turn_rate"),
    ],
)
def test_motors_that_cannot_be_are_refused(settings: str, message: str) -> None:
    assert refused(SMALL.replace("n: 12", f"n: 12, {settings}")).startswith(message)


def test_motors_need_a_model_that_drives_its_boids(tmp_path: Path) -> None:
    """And the error says which line is missing; without motors the model flies."""
    text = Path("examples/vortex.py").read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    kept = [line for line in lines if "drive" not in line]
    assert len(lines) - len(kept) == 3  # imported, called and declared
    (tmp_path / "vortex.py").write_text("".join(kept), encoding="utf-8")
    spec = "study: my/slow\nmodel: ./vortex.py\nreplicates: 1\n"
    path = tmp_path / "slow.yaml"
    path.write_text(spec, encoding="utf-8")
    expand(load_spec(path))
    path.write_text(spec + "fixed: {motor_lag: 2}\n", encoding="utf-8")
    with pytest.raises(SpecError) as error:
        expand(load_spec(path))
    assert "slow.yaml:4: motor_lag needs a model that drives its boids" in str(
        error.value
    )
    assert LINE in str(error.value)
    assert "in its Model" not in str(error.value)


@pytest.mark.parametrize(
    ("ability", "settings"),
    [
        ("drives", "motor_lag: 2"),
        ("publishes", "failing_share: 0.5, failing_how: blind, failing_time: 1"),
    ],
)
def test_a_declaration_is_what_is_to_change_where_the_source_has_the_call(
    ability: str, settings: str, tmp_path: Path
) -> None:
    text = Path("examples/vortex.py").read_text(encoding="utf-8")
    assert text.count(f"{ability}=True") == 1
    path = tmp_path / "slow.yaml"
    path.write_text(
        f"study: my/slow\nmodel: ./vortex.py\nreplicates: 1\nfixed: {{{settings}}}\n",
        encoding="utf-8",
    )
    (tmp_path / "vortex.py").write_text(text, encoding="utf-8")
    expand(load_spec(path))
    narrowed = text.replace(f"{ability}=True", f"{ability}=False")
    (tmp_path / "vortex.py").write_text(narrowed, encoding="utf-8")
    with pytest.raises(SpecError) as error:
        expand(load_spec(path))
    assert str(error.value).endswith(
        f"but vortex declares {ability}=False: declare {ability}=True in its Model;"
        " see docs/own-models.md"
    )
