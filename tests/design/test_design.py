"""A design is the product of its axes in the order of the file, with the conditions of
the spec applied.
"""

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.catalogue import BUILT_IN
from sweep.design.design import Design, Rejection, expand
from sweep.design.jobs import Jobs
from sweep.design.plan import make_plan
from sweep.errors import SpecError
from sweep.spec.expressions import parse
from sweep.spec.settings import Value, preset_settings, settings_of
from sweep.spec.study import parse_spec
from tests.specs import EVERYTHING, GAINS, SEPARATION, SHORT, short, short_study


def rows(design: Design) -> list[tuple[Value, ...]]:
    return list(
        zip(*(column.tolist() for column in design.columns.values()), strict=True)
    )


def test_examples_expand() -> None:
    assert rows(expand(parse_spec(SEPARATION))) == [
        (0.5,),
        (0.75,),
        (1.0,),
        (1.5,),
        (2.0,),
    ]
    gains = expand(parse_spec(GAINS))
    assert gains.n_points == 16_000
    assert list(gains.columns) == [
        "map",
        "n",
        "cohesion_weight",
        "alignment_weight",
        "separation_weight",
    ]
    assert expand(parse_spec(EVERYTHING)).n_points > 0


def test_study_without_axes_has_one_point() -> None:
    design = expand(short_study("fixed: {n: 7}"))
    assert design.n_points == 1
    assert design.settings(0) == preset_settings("nguyen2024", "as_run", BUILT_IN) | {
        "n": 7
    }


def test_settings_are_plain_python_values_of_every_field() -> None:
    design = expand(
        short_study(
            "sweep: {n: [3, 4], drag: [0, 1], map: [empty], minimum_image: [true]}"
        )
    )
    settings = design.settings(1)
    assert set(settings) == set(settings_of("nguyen2024", BUILT_IN))
    assert {
        name: repr(settings[name]) for name in ("n", "drag", "map", "minimum_image")
    } == {
        "n": "3",
        "drag": "1.0",
        "map": "'empty'",
        "minimum_image": "True",
    }


VALUES = st.lists(st.integers(1, 50), min_size=1, max_size=4, unique=True)


@settings(deadline=None, max_examples=40)
@given(VALUES, VALUES, VALUES)
def test_product_has_the_order_of_itertools(
    n: list[int], steps: list[int], weights: list[int]
) -> None:
    design = expand(
        short_study(f"sweep: {{n: {n}, steps: {steps}, separation_weight: {weights}}}")
    )
    assert rows(design) == list(product(n, steps, weights))


@settings(deadline=None, max_examples=40)
@given(VALUES, VALUES, st.integers(1, 50))
def test_conditional_axis_agrees_with_a_loop(
    n: list[int], steps: list[int], limit: int
) -> None:
    study = short_study(
        f"sweep: {{n: {n}, steps: {{values: {steps}, when: n < {limit}}}, drag: [0,"
        " 1]}"
    )
    expected = [
        (number, step, drag)
        for number in n
        for step in (steps if number < limit else [500])
        for drag in (0.0, 1.0)
    ]
    assert rows(expand(study)) == expected


def test_zip_and_product_combine() -> None:
    study = short_study(
        "sweep: {z: {zip: {n: [1, 2], steps: {linspace: [10, 20, 2]}}}, drag: [0, 1]}"
    )
    assert rows(expand(study)) == [
        (1, 10, 0.0),
        (1, 10, 1.0),
        (2, 20, 0.0),
        (2, 20, 1.0),
    ]


def test_repeated_rows_of_an_axis_are_merged() -> None:
    design = expand(
        short_study("sweep: {z: {zip: {n: [1, 2, 1], drag: [0, 0, 0]}}, steps: [5, 6]}")
    )
    assert rows(design) == [(1, 0.0, 5), (1, 0.0, 6), (2, 0.0, 5), (2, 0.0, 6)]
    assert design.duplicates == 1


def test_derived_fields_follow_their_dependencies() -> None:
    study = short_study(
        "sweep: {n: [1, 2]}",
        "derive: {alignment_weight: separation_weight / 2, separation_weight: 4 * n,"
        " steps: n + drag * 10}",
    )
    design = expand(study)
    assert list(design.columns) == [
        "n",
        "separation_weight",
        "steps",
        "alignment_weight",
    ]
    assert rows(design) == [(1, 4.0, 2, 2.0), (2, 8.0, 3, 4.0)]


def test_derived_choices_and_truths() -> None:
    study = short_study(
        "sweep: {n: [1, 2]}",
        "derive: {update: \"'sequential' if n > 1 else 'synchronous'\", minimum_image:"
        " n > 1}",
    )
    assert rows(expand(study)) == [(1, "synchronous", False), (2, "sequential", True)]


def test_rejected_points_are_counted_by_the_first_reason() -> None:
    design = expand(
        short_study(
            "sweep: {n: [1, 2, 3, 4, 5]}", "require: [n > 1, n % 2 == 1, n < 100]"
        )
    )
    assert rows(design) == [(3,), (5,)]
    assert design.rejected == (
        Rejection("n > 1", 1),
        Rejection("n % 2 == 1", 2),
        Rejection("n < 100", 0),
    )


def test_nothing_is_derived_for_a_rejected_point() -> None:
    study = short_study(
        "sweep: {n: [1, 2, 3]}", "derive: {steps: n - 1}", "require: [n > 1, steps < 2]"
    )
    assert rows(expand(study)) == [(2, 1)]


def test_map_brings_its_size() -> None:
    swept = expand(
        short_study("sweep: {map: [random_obstacles, cafeteria], n: [1, 2]}")
    )
    sides = [
        (settings["width"], settings["height"])
        for settings in map(swept.settings, range(4))
    ]
    assert sides == [(1280.0, 740.0)] * 2 + [(800.0, 600.0)] * 2
    fixed = expand(short_study("fixed: {map: cafeteria}", "sweep: {n: [1, 2]}"))
    assert fixed.settings(1)["width"] == 800.0
    assert list(fixed.columns) == ["n"]
    agreeing = expand(short_study("fixed: {map: cafeteria, width: 800}"))
    assert (agreeing.settings(0)["width"], agreeing.settings(0)["height"]) == (
        800.0,
        600.0,
    )


def test_condition_and_derived_field_see_the_size_of_the_map() -> None:
    study = short_study(
        "sweep: {map: [random_obstacles, cafeteria], n: {values: [1, 2], when: width <"
        " 1000}}",
        "derive: {start_margin: height / 10}",
    )
    assert [(row[0], row[1], row[-1]) for row in rows(expand(study))] == [
        ("random_obstacles", 1280.0, 74.0),
        ("cafeteria", 800.0, 60.0),
        ("cafeteria", 800.0, 60.0),
    ]


MISTAKES = [
    (
        ["fixed: {map: cafeteria}", "sweep: {width: [800, 900]}"],
        "7: map cafeteria is 800 x 600 px: leave width and height out",
    ),
    (
        ["fixed:", "  height: 601", "sweep: {map: [cafeteria]}"],
        "7: map cafeteria is 800 x 600 px: leave width",
    ),
    (
        ["sweep: {n: [2, 1]}", "derive:", "  drag: 1 / (n - 1)"],
        '8: "1 / (n - 1)" is not a finite number where n = 1',
    ),
    (
        ["sweep: {n: [1, 2], steps: [3]}", "derive: {drag: n + steps}"],
        (
            '7: "n + steps": 4.0 is not allowed for drag; allowed: a number from 0 to 1'
            " where n = 1, steps = 3"
        ),
    ),
    (
        ["sweep: {n: [1, 3]}", "derive: {steps: n / 2}"],
        '7: "n / 2": 0.5 is not allowed for steps; allowed: an integer',
    ),
    (
        ["require: ['1 / n_obstacles > 0']", "fixed: {n_obstacles: 0}"],
        '6: "1 / n_obstacles" is not a finite number',
    ),
    (["sweep: {n: [0, 1]}"], "6: 0 is not allowed for n"),
    (
        ["sweep: {n: [1, 2, 3]}", "require:", "  - n > 1", "  - n > 5"],
        '7: no point is left: "n > 1" rejects 1, "n > 5" rejects 2',
    ),
    (
        [
            "sweep:",
            "  n: {linspace: [1, 10000, 10000]}",
            "  steps: {linspace: [1, 100000, 100000]}",
            "  drag: {linspace: [0, 1, 10000]}",
        ],
        "6: the study has 10,000,000,000,000 points; at most 10,000,000 are allowed",
    ),
    (
        [
            "sweep:",
            "  n: {linspace: [1, 4000, 4000]}",
            "  steps: {linspace: [1, 4000, 4000], when: n > 1}",
        ],
        "6: the study has 15,996,001 points; at most 10,000,000 are allowed",
    ),
]


@pytest.mark.parametrize(
    ("lines", "message"), MISTAKES, ids=[lines[-1][:50] for lines, _ in MISTAKES]
)
def test_mistake_is_named_with_its_line(lines: list[str], message: str) -> None:
    with pytest.raises(SpecError) as error:
        expand(parse_spec(short(*lines)))
    assert str(error.value).startswith(f"spec.yaml:{message}")


def test_absurd_number_of_trials_is_refused() -> None:
    spec = (
        SHORT.replace("replicates: 2", "replicates: 15_000_000")
        + "sweep: {n: [1, 2]}\n"
    )
    with pytest.raises(
        SpecError,
        match=r"^spec.yaml:4: the study has 30,000,000 trials; at most 20,000,000",
    ):
        expand(parse_spec(spec))


WRAPS = (
    "the torus of preset as_run wraps positions only: boids do not perceive each"
    " other across the borders; with `minimum_image: true` they do"
)
IDLE = "nearest changes nothing: no point has neighbours == 'nearest'"
NOISE = "changes nothing: no point has position_noise > 0 or velocity_noise > 0"


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("fixed: {nearest: 5}", [IDLE]),
        ("sweep: {nearest: [5, 7]}", [IDLE]),
        ("derive: {nearest: n + 1}", [IDLE]),
        ("fixed: {nearest: 5}\nsweep: {neighbours: [voronoi, metric]}", [IDLE]),
        ("fixed: {neighbours: nearest, nearest: 5}", []),
        ("sweep: {nearest: [5, 7], neighbours: [nearest, voronoi]}", []),
        ("fixed: {neighbours: voronoi}", []),
        (
            "fixed: {noise_time: 3, own_noise: shared}",
            [f"noise_time {NOISE}", f"own_noise {NOISE}"],
        ),
        ("fixed: {noise_time: 3}\nsweep: {velocity_noise: [0, 0.1]}", []),
        (
            "fixed: {motor_spread: 0.1, failing_how: drift, packet_loss_range: 9}",
            [
                "packet_loss_range changes nothing: no point has packet_loss > 0",
                "motor_spread changes nothing: no point has motor_lag > 0 or"
                " motor_min_speed > 0 or min(motor_acceleration, motor_turn_rate,"
                " motor_max_speed) < 1e299",
                "failing_how changes nothing: no point has failing_share > 0",
            ],
        ),
        ("fixed: {motor_spread: 0.1, motor_max_speed: 2}", []),
        (
            "fixed: {goals_repeat: true}",
            ["goals_repeat changes nothing: no point has next_goals != ''"],
        ),
        (
            "fixed: {gust_time: 3}",
            ["gust_time changes nothing: no point has gust > 0"],
        ),
    ],
)
def test_the_plan_says_which_settings_change_nothing(
    lines: str, said: list[str]
) -> None:
    assert make_plan(short_study(lines), 1).notes == (*said, WRAPS)


def test_what_a_setting_waits_for_is_a_condition_on_others() -> None:
    for model in BUILT_IN.models:
        known = settings_of(model, BUILT_IN)
        waits = {name: one.only_where for name, one in known.items() if one.only_where}
        assert len(waits) == 18
        for name, one in waits.items():
            assert name not in parse(one.condition, known).names


PERIODIC = [
    ("fixed: {borders: torus}", [True]),
    ("fixed: {borders: torus, minimum_image: false}", [False]),
    ("fixed: {borders: bounded}", [False]),
    ("fixed: {n: 5}", [False]),
    ("fixed: {minimum_image: true}", [True]),
    ("sweep: {borders: [open, torus, bounded]}", [False, True, False]),
    ("sweep: {both: {zip: {borders: [torus, open], n: [3, 4]}}}", [True, False]),
    (
        'sweep: {n: [3, 4], borders: {values: [torus, bounded], when: "n == 3"}}',
        [True, False, False],
    ),
    (
        "fixed: {minimum_image: false}\nsweep: {borders: [open, torus]}",
        [False, False],
    ),
    ("sweep: [{borders: [torus]}, {n: [3]}]", [True, False]),
    (
        "sweep: {n: [3, 4]}\nderive: {borders: \"'torus' if n == 3 else 'open'\"}",
        [True, False],
    ),
    (
        "sweep: {n: [3, 4]}\nderive:\n  steps: 2 if minimum_image else 1\n"
        "  borders: \"'torus' if n == 3 else 'open'\"\n",
        [True, False],
    ),
    ("sweep: {borders: [open, torus]}\nrequire: [minimum_image]", [True]),
    (
        "sweep: {n: [3, 4]}\nderive: {borders: \"'torus' if n == 3 else 'open'\"}\n"
        "require: [not minimum_image]",
        [False],
    ),
    (
        "sweep:\n  borders: [open, torus]\n"
        "  drag: {values: [0, 1], when: minimum_image}\n",
        [False, True, True],
    ),
    ("sweep: {it: {ablate: {wall: {borders: bounded}}}}", [False, False]),
    ("sweep: {it: {ablate: {across: {minimum_image: true}}}}", [False, True]),
]
"""Keys of a spec of nguyen2024, as_run, whose own torus wraps positions only, and what
`minimum_image` is at its points.
"""


@pytest.mark.parametrize(("keys", "across"), PERIODIC)
def test_a_torus_that_a_spec_names_is_periodic(keys: str, across: list[bool]) -> None:
    study = short_study(keys)
    points = expand(study)
    found = [points.settings(point) for point in range(points.n_points)]
    assert [one["minimum_image"] for one in found] == across
    for one in found:
        if "steps" in study.derive:
            assert one["steps"] == (2 if one["minimum_image"] else 1)


def test_borders_that_a_detail_names_are_periodic_with_it() -> None:
    """They change together, unless the spec says otherwise."""
    head = short("preset: as_written").replace("preset: as_run\n", "")

    def found(details: str) -> list[tuple[Value, Value]]:
        study = parse_spec(f"{head}sweep: {{it: {{ablate: {{{details}}}}}}}\n")
        points = map(expand(study).settings, range(expand(study).n_points))
        return [(one["borders"], one["minimum_image"]) for one in points]

    flat, across, wraps = ("open", False), ("torus", True), ("torus", False)
    assert found("round: {borders: torus}") == [flat, across]
    assert found("round: {borders: torus, minimum_image: false}, more: {drag: 1}") == [
        *(flat, wraps, flat, wraps),
    ]


@pytest.mark.parametrize(
    ("preset", "other"), [("as_run", "as_written"), ("as_written", "as_run")]
)
def test_the_torus_of_a_preset_is_the_same_on_the_way_to_another(
    preset: str, other: str
) -> None:
    text = SHORT.replace("as_run", preset) + f"sweep: {{it: {{ablate: {other}}}}}\n"
    design = expand(parse_spec(text))
    assert set(design.columns["borders"]) == {"open", "torus"}
    assert design.base["minimum_image"] is False


def test_borders_that_are_swept_come_before_what_asks_for_them() -> None:
    keys = "sweep:\n  drag: {values: [0], when: minimum_image}\n  borders: [torus]\n"
    with pytest.raises(SpecError, match='when cannot use "borders" here'):
        short_study(keys)


POINTS = [
    ("nguyen2024, preset: as_run, fixed: {n: 30}", ["e63919f629424a43"]),
    (
        "nguyen2024, preset: as_run, sweep: {borders: [open, bounded]}",
        ["a72eb908d1281366", "279b4cab578844ee"],
    ),
    (
        "vicsek1995, preset: as_written, sweep: {noise: [0.1, 1]}",
        ["4e1206402163423f", "4c18d8dd1c8bfc1b"],
    ),
    (
        "vicsek1995, preset: as_written, fixed: {borders: open, minimum_image: false}",
        ["896dcdb19836b797"],
    ),
    ("vicsek1995, preset: as_written, fixed: {borders: open}", ["896dcdb19836b797"]),
    (
        "couzin2002, preset: as_run, fixed: {borders: torus, minimum_image: false}",
        ["99bd5b6fe3c3afcf"],
    ),
    (
        "couzin2002, preset: as_run, fixed: {borders: torus, minimum_image: true}",
        ["01a42e2e28e1ef3c"],
    ),
    ("couzin2002, preset: as_run, fixed: {borders: torus}", ["01a42e2e28e1ef3c"]),
]
"""Specs whose points have had these ids since before a torus was periodic by itself."""


@pytest.mark.parametrize(("keys", "ids"), POINTS)
def test_points_keep_their_ids_where_boids_see_the_same(
    keys: str, ids: list[str]
) -> None:
    study = parse_spec(
        f"{{study: kept, replicates: 1, record: {{metrics: [speed]}}, model: {keys}}}"
    )
    assert Jobs(study, expand(study)).points == ids


SHORTER = "fixed: {width: 80, height: 90, map: empty, borders: bounded"


@pytest.mark.parametrize(
    ("keys", "noted"),
    [
        ("fixed: {n: 5}", [WRAPS]),
        ("sweep: {borders: [open, torus]}", []),
        ("fixed: {borders: torus}", []),
        ("fixed: {minimum_image: false}", []),
        ("fixed: {minimum_image: true}", []),
        ("fixed: {borders: bounded}", []),
        (
            SHORTER + "}\nrecord: {metrics: [flock_count, boids_lost, fusions, speed]}",
            [
                "flock_range is 50 px, more than half of the world, 40 px: the motion"
                " of boids hardly changes flock_count, boids_lost, fusions"
            ],
        ),
        (
            SHORTER + ", contact_distance: 41}\nrecord: {metrics: [pair_collisions,"
            " in_contact_of_working, escapes]}",
            [
                "contact_distance is 41 px, more than half of the world, 40 px: the"
                " motion of boids hardly changes pair_collisions, in_contact_of_working"
            ],
        ),
        (SHORTER + "}\nrecord: {metrics: [polarization]}", []),
        (SHORTER + ", flock_range: .inf}\nrecord: {metrics: [flock_count]}", []),
        (
            "sweep: {borders: [open]}\nfixed: {width: 80, height: 90, map: empty,"
            " flock_range: 60}\nrecord: {metrics: [flock_count]}",
            [],
        ),
        (
            "sweep: {borders: [open]}\nfixed: {width: 80, height: 90, map: empty}\n"
            "record: {metrics: [flock_count]}",
            [
                "flock_range is 50 px, more than half of the world, 40 px: the motion"
                " of boids hardly changes flock_count"
            ],
        ),
    ],
)
def test_the_plan_says_what_of_the_world_one_might_not_expect(
    keys: str, noted: list[str]
) -> None:
    head = SHORT
    if "record:" in keys:
        head = "".join(
            line for line in SHORT.splitlines(True) if not line.startswith("record")
        )
    assert make_plan(parse_spec(f"{head}{keys}\n"), 1).notes == tuple(noted)
