"""The axis from one preset to another changes each detail
alone, and last all of them.
"""

from itertools import permutations
from pathlib import Path

import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.cli.listing import table_text
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError, SpecError
from sweep.spec.ablation import WORLD
from sweep.spec.settings import Value, preset_settings, settings_of
from sweep.spec.study import Study, parse_spec
from sweep.tables.point_means import point_means
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
        with pytest.raises(SpecError, match="in no setting that the spec leaves open"):
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
            "6: as_run is the preset of the study: ablate needs another one. Allowed:"
            " as_written"
        ),
    ),
    (
        ["sweep: {drag: {ablate: as_written}}"],
        '6: "drag" is a setting: an axis that ablates needs a name of its own',
    ),
    (
        ["sweep: {detail: {ablate: as_written, points: 3}}"],
        '6: unknown key "points". Allowed: ablate, when',
    ),
    (
        ["sweep:", "  a: {ablate: as_written}", "  b: {ablate: as_written}"],
        '8: "a" ablates already: a study has one',
    ),
    (
        ["sweep: {detail: {ablate: as_written, when: drag > 1}}"],
        '6: when cannot use "drag" here: it is swept by detail',
    ),
    (["sweep: {detail: {ablate: 5}}"], '6: "ablate" must be a text, not 5'),
]


@pytest.mark.parametrize(
    ("lines", "message"), MISTAKES, ids=[lines[-1][:50] for lines, _ in MISTAKES]
)
def test_mistake_is_named_with_its_line(lines: list[str], message: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(short(*lines))
    assert str(error.value).startswith(f"spec.yaml:{message}")


def test_presets_that_differ_in_nothing_open_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    presets = MODELS["nguyen2024"].presets
    monkeypatch.setitem(presets, "heavy", presets["as_run"] | {"drag": 0.5, "n": 7})
    with pytest.raises(
        SpecError,
        match="6: nothing would change: heavy differs from as_run in no setting that",
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
    table_text(study, found)
    shown = capsys.readouterr().out
    assert "displacement_factor" in shown
    assert "drag" in shown
