"""The axis from one preset to another changes each detail
alone, and last all of them.
"""

from itertools import permutations
from pathlib import Path

import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.cli.reporting import print_report
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError, SpecError
from sweep.methods.comparison import side_of
from sweep.spec.ablation import WORLD, label
from sweep.spec.settings import Value, preset_settings, settings_of
from sweep.spec.study import Study, parse_spec
from sweep.tables.means import point_means
from sweep.tables.means_text import means_report
from tests.specs import SHORT, short, short_study
from tests.studies import SMALL, launched

ABLATED = "sweep: {detail: {ablate: as_written}}"


PAIRS = [
    (model, *pair)
    for model in MODELS
    for pair in permutations(MODELS[model].presets, 2)
]


@pytest.mark.parametrize(("model", "preset", "other"), PAIRS)
def test_each_difference_comes_alone_in_the_order_of_the_fields_and_last_all(
    model: str, preset: str, other: str
) -> None:
    before, after = (
        preset_settings(model, preset, BUILT_IN),
        preset_settings(model, other, BUILT_IN),
    )
    differing = [
        name
        for name in settings_of(model, BUILT_IN)
        if before[name] != after[name] and name not in ("n", "steps")
    ]
    world = [name for name in differing if name in WORLD]
    changes = list(
        dict.fromkeys(tuple(world) if name in WORLD else (name,) for name in differing)
    )
    spec = (
        SHORT.replace("nguyen2024", model).replace("as_run", preset)
        + f"sweep: {{detail: {{ablate: {other}}}}}\n"
    )
    if not differing:
        with pytest.raises(SpecError, match="ablate changes no parameter"):
            parse_spec(spec)
        return
    (axis,) = parse_spec(spec).axes
    assert list(axis.columns) == [name for change in changes for name in change]
    rows = [(), *changes, *([differing] if len(changes) > 1 else [])]
    for name, column in axis.columns.items():
        assert column.tolist() == [
            (after if name in row else before)[name] for row in rows
        ]


def columns(*lines: str) -> set[str]:
    """The settings that the axis `detail` of a short study changes."""
    return next(
        set(axis.columns) for axis in short_study(*lines).axes if axis.name == "detail"
    )


def test_what_is_given_elsewhere_stays() -> None:
    whole = columns(ABLATED)
    assert whole - columns(ABLATED, "fixed: {drag: 0.5}") == {"drag"}
    assert whole - columns(ABLATED, "derive: {drag: 1 / n}") == {"drag"}
    assert whole - columns("sweep: {detail: {ablate: as_written}, drag: [0, 1]}") == {
        "drag"
    }


def points(study: Study) -> list[str]:
    return Jobs(study, expand(study)).points


def test_the_unchanged_row_is_the_point_of_the_study_without_the_axis() -> None:
    plain, ablated = (
        points(short_study("sweep: {n: [3, 4]}")),
        points(short_study(ABLATED[:-1] + ", n: [3, 4]}")),
    )
    assert ablated[:2] == plain
    assert len(set(ablated)) == len(ablated)


def test_elsewhere_than_under_its_condition_nothing_is_changed() -> None:
    study = short_study("sweep: {n: [3, 4], detail: {ablate: as_written, when: n > 3}}")
    counts = [
        expand(study).settings(point)["n"] for point in range(expand(study).n_points)
    ]
    assert (counts.count(3), counts.count(4)) == (1, len(study.axes[1]))


WORLDS = [
    (
        {"map": "cafeteria", "width": 800.0, "height": 600.0},
        ("map", "width", "height"),
        (800.0, 600.0),
    ),
    (
        {"map": "cafeteria", "width": 7.0, "height": 7.0},
        ("map", "width", "height"),
        (800.0, 600.0),
    ),
    ({"width": 900.0}, ("width",), (900.0, 740.0)),
    ({"map": "empty"}, ("map",), (1280.0, 740.0)),
]


@pytest.mark.parametrize(("world", "names", "size"), WORLDS, ids=str)
def test_the_map_and_its_size_change_together(
    world: dict[str, Value],
    names: tuple[str, ...],
    size: tuple[float, float],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    presets = MODELS["nguyen2024"].presets
    monkeypatch.setitem(presets, "elsewhere", presets["as_run"] | world | {"drag": 0.5})
    study = short_study("sweep: {detail: {ablate: elsewhere}}")
    assert study.axes[0].details == (("drag",), names)
    last = expand(study).settings(3)
    assert (last["drag"], last["width"], last["height"]) == (0.5, *size)
    assert columns("sweep: {detail: {ablate: elsewhere}}", "fixed: {height: 600}") == {
        "drag"
    }


def test_a_single_difference_makes_two_points(monkeypatch: pytest.MonkeyPatch) -> None:
    presets = MODELS["nguyen2024"].presets
    monkeypatch.setitem(
        presets, "heavy", presets["as_run"] | {"drag": 0.5, "n": 7, "steps": 8}
    )
    design = expand(short_study("sweep: {detail: {ablate: heavy}}"))
    assert (design.n_points, design.duplicates, list(design.columns)) == (
        2,
        0,
        ["drag"],
    )


MISTAKES = [
    (
        ["sweep: {detail: {ablate: as_writen}}"],
        '6: unknown preset of nguyen2024 "as_writen"; did you mean "as_written"?',
    ),
    (
        ["sweep: {detail: {ablate: as_run}}"],
        (
            "6: as_run is the preset of the study: ablate needs another preset."
            " Allowed: as_written"
        ),
    ),
    (
        ["sweep: {drag: {ablate: as_written}}"],
        '6: "drag" is a parameter: an axis with ablate needs a different name',
    ),
    (
        ["sweep: {detail: {ablate: as_written, points: 3}}"],
        '6: unknown key "points". Allowed: ablate, leave_out, when',
    ),
    (
        ["sweep:", "  a: {ablate: as_written}", "  b: {ablate: as_written}"],
        '8: "a" already has ablate: a study has at most one',
    ),
    (
        ["sweep: {detail: {ablate: as_written, when: drag > 1}}"],
        '6: when cannot use "drag" here: "drag" is swept by detail',
    ),
    (["sweep: {detail: {ablate: 5}}"], '6: "ablate" must be a string, not 5'),
    (["sweep: {detail: {ablate: {}}}"], '6: "ablate" must be a mapping with'),
]


@pytest.mark.parametrize(
    ("lines", "message"), MISTAKES, ids=[lines[-1][:50] for lines, _ in MISTAKES]
)
def test_mistake_is_named_with_its_line(lines: list[str], message: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(short(*lines))
    assert str(error.value).startswith(f"spec.yaml:{message}")


NAMED = """\
sweep:
  real:
    ablate:
      noise: {position_noise: 2, noise_time: 5}
      late: {sensing_delay: 3}
      failing: {failing_share: 0.5, failing_how: stop}
"""
VALUES: dict[str, dict[str, Value]] = {
    "noise": {"position_noise": 2.0, "noise_time": 5.0},
    "late": {"sensing_delay": 3.0},
    "failing": {"failing_share": 0.5, "failing_how": "stop"},
}


def changed_in_rows(study: Study) -> list[set[str]]:
    """The details whose settings all have the value of the spec, row by row; and no
    setting has another value than that or the preset's.
    """
    (axis,) = study.axes
    before = preset_settings("nguyen2024", "as_run", BUILT_IN)
    rows = []
    for row in range(len(axis)):
        found = set[str]()
        for detail, values in VALUES.items():
            there = {name: axis.columns[name].tolist()[row] for name in values}
            assert there in (values, {name: before[name] for name in values})
            if there == values:
                found.add(detail)
        rows.append(found)
    return rows


def test_a_named_detail_changes_its_settings_together() -> None:
    study = short_study(NAMED)
    (axis,) = study.axes
    assert (axis.ablated, axis.named) == ("real", tuple(VALUES))
    assert axis.details == tuple(tuple(values) for values in VALUES.values())
    assert changed_in_rows(study) == [
        set(),
        {"noise"},
        {"late"},
        {"failing"},
        set(VALUES),
    ]


def test_with_leave_out_each_detail_is_also_taken_from_all() -> None:
    assert changed_in_rows(short_study(NAMED + "    leave_out: true\n")) == [
        set(),
        {"noise"},
        {"late"},
        {"failing"},
        {"late", "failing"},
        {"noise", "failing"},
        {"noise", "late"},
        set(VALUES),
    ]
    plain = short_study(NAMED)
    assert points(short_study(NAMED + "    leave_out: false\n")) == points(plain)


def test_details_of_a_preset_are_left_out_too() -> None:
    study = short_study("sweep: {detail: {ablate: as_written, leave_out: true}}")
    (axis,) = study.axes
    design = expand(study)
    assert len(set(points(study))) == 2 * len(axis.details) + 2 == design.n_points


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ((False, False, False), ""),
        ((False, True, False), "b"),
        ((True, True, False), "all but c"),
        ((True, True, True), "all"),
        ((False, True), "b"),
        ((True,), "a"),
        ((True, False, True, False), "a + c"),
    ],
)
def test_labels_say_which_details_are_there(
    changed: tuple[bool, ...], words: str
) -> None:
    assert label(changed, "abcd"[: len(changed)]) == words


def named(*details: str) -> list[str]:
    return ["sweep:", "  real:", "    ablate:", *("      " + one for one in details)]


MISTAKEN_DETAILS = [
    (named("late: {sensing_dela: 3}"), 'unknown parameter "sensing_dela"; did you'),
    (named("late: {sensing_delay: -3}"), "9: -3 is not allowed for sensing_delay"),
    (named("late: {failing_how: fly}"), 'unknown failing_how "fly"'),
    (named("late: 3"), '9: "late" must be parameters with values, such as'),
    (named("late: {}"), '9: "late" must be parameters with values, such as'),
    (
        named("late: {sensing_delay: 0}"),
        '9: "late" changes no value of the preset as_run',
    ),
    (
        named("a: {sensing_delay: 2}", "b: {sensing_delay: 3}"),
        '10: "sensing_delay" is already in the component "a"',
    ),
    (named("big: {n: 9}"), '9: "n" cannot be in a component: paired trials have'),
    (named("big: {map: empty}"), '9: "map" cannot be in a component'),
    (named('"a+b": {drag: 0.5}'), 'component "a+b" is not allowed: a name of a'),
    (named("all: {drag: 0.5}"), 'component "all" is not allowed: "all" and "all but'),
    (named("all but a: {drag: 0.5}"), 'component "all but a" is not allowed'),
    (
        [*named("heavy: {drag: 0.5}"), "fixed: {drag: 0}"],
        '9: "drag" also has a value elsewhere in the spec',
    ),
    (
        [*named("heavy: {drag: 0.5}"), "  drag: [0, 1]"],
        '9: "drag" also has a value elsewhere in the spec',
    ),
    (
        [*named("a: {drag: 0.5}", "b: {sensing_delay: 3}"), "    leave_out: true"],
        "leave_out needs 3 components, and there are 2",
    ),
    (
        [*named("a: {drag: 0.5}"), "    leave_out: 1"],
        '"leave_out" must be true or false',
    ),
    (
        ["sweep: {as_written: {ablate: {a: {drag: 0.5}}}}"],
        '"as_written" is a preset of nguyen2024: an axis with components needs a',
    ),
]


@pytest.mark.parametrize(
    ("lines", "message"),
    MISTAKEN_DETAILS,
    ids=[f"{number} {lines[3:]}" for number, (lines, _) in enumerate(MISTAKEN_DETAILS)],
)
def test_a_mistake_in_details_is_named(lines: list[str], message: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(short(*lines))
    assert message in str(error.value)


def test_all_mistakes_in_details_are_said_at_once() -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(short(*named("a: {dragg: 0.5}", "b: 3", "c: {drag: 7}")))
    lines = [str(one) for one in error.value.mistakes]
    assert [line.split()[0] for line in lines] == [
        f"spec.yaml:{n}:" for n in (9, 10, 11)
    ]
    for line, text in zip(lines, ('"dragg"', '"b" must be', "7 is not"), strict=True):
        assert text in line


def test_tables_call_details_by_their_names(tmp_path: Path) -> None:
    spec = SMALL.replace(
        "sweep:\n  separation_weight: [0.5, 1]\n", NAMED + "    leave_out: true\n"
    )
    study = launched(spec, tmp_path)
    rows = point_means(study, ["speed"]).rows
    assert list(rows["detail"]) == [
        "",
        *VALUES,
        *(f"all but {name}" for name in VALUES),
        "all",
    ]
    assert list(study.details("real").unique()) == list(rows["detail"])
    part = study.where(detail="all but late")
    assert set(part.trials["sensing_delay"]) == {0}
    assert set(part.trials["position_noise"]) == {2}
    assert side_of("small:real", study).trials["sensing_delay"].eq(3).all()


def test_presets_that_differ_in_nothing_open_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    presets = MODELS["nguyen2024"].presets
    monkeypatch.setitem(presets, "heavy", presets["as_run"] | {"drag": 0.5, "n": 7})
    with pytest.raises(
        SpecError,
        match="6: ablate changes no parameter: heavy equals as_run in all parameters",
    ):
        short_study("sweep: {detail: {ablate: heavy}}", "fixed: {drag: 0}")


def test_details_name_what_was_changed_in_each_trial(tmp_path: Path) -> None:
    spec = SMALL.replace(
        "separation_weight: [0.5, 1]", "detail: {ablate: as_written}\n  drag: [0, 0.1]"
    )
    study = launched(spec.replace("replicates: 3", "replicates: 1"), tmp_path)
    labels = study.details("as_written")
    assert list(labels.index) == list(study.trials["trial_id"])
    changed = [name for name in study.varied if name != "drag"]
    assert list(labels) == [label for label in ["", *changed, "all"] for _ in range(2)]
    with pytest.raises(ChoiceError, match='unknown ablated preset "as_run"'):
        study.details("as_run")
    with pytest.raises(
        ChoiceError, match='unknown ablated preset "as_written": there is none'
    ):
        launched(SMALL, tmp_path).details("as_written")


def test_a_table_has_one_column_for_the_detail_that_is_changed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = SMALL.replace(
        "separation_weight: [0.5, 1]",
        "separation_weight: [0.5, 1]\n  detail: {ablate: as_written}",
    )
    study = launched(spec, tmp_path)
    found = point_means(study, ["speed"])
    rows = found.rows
    assert list(rows.columns[:3]) == ["separation_weight", "detail", "speed"]
    assert list(zip(rows["separation_weight"], rows["detail"], strict=True))[:3] == [
        (0.5, ""),
        (0.5, "obstacle_range"),
        (0.5, "displacement_factor"),
    ]
    assert set(rows["speed_n"]) == {3}
    print_report(means_report(study, found))
    shown = capsys.readouterr().out
    assert "displacement_factor" in shown
    assert "drag" in shown
