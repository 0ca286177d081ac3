"""More points in a region of a study, and more trials: what becomes of its spec."""

import pytest

from sweep.design.design import expand
from sweep.errors import ChoiceError
from sweep.explorer.refining import Extension, refined
from sweep.own_code.reading import study_of
from sweep.spec.study import Study

HEAD = """# what it is about
study: small
model: nguyen2024
fixed: {steps: 9}   # few
"""
FOOT = """replicates: 3   # for a start
record: {metrics: [speed]}
"""


def spec(sweep: str, foot: str = FOOT) -> Study:
    return study_of(f"{HEAD}sweep:\n{sweep}{foot}")


DRAWN = "  some: {sample: random, points: 9, separation_weight: {uniform: [1, 2]}}\n"
BOUNDARY = """replicates: 3
record: {metrics: [speed]}
refine:
  metric: speed
  at: 1
  axes: [separation_weight]
  until: 0.1
  max: 9
  budget: 900
"""
GRID = "  separation_weight: {linspace: [0, 1, 5]}  # five\n  n: [10, 20, 40]\n"


def points(study: Study) -> set[tuple[float, ...]]:
    design = expand(study)
    columns = [column.tolist() for column in design.columns.values()]
    return set(zip(*columns, strict=True))


def finer(study: Study, **wanted: object) -> Study:
    return study_of(refined(study, Extension(**wanted)))  # type: ignore[arg-type]


def test_intervals_of_the_region_are_divided_and_no_point_is_lost() -> None:
    before = spec(GRID)
    after = finer(before, between={"separation_weight": (0.3, 0.6)}, parts=2)
    new = points(after) - points(before)
    assert points(before) < points(after)
    assert new == {(one, n) for one in (0.375, 0.625) for n in (10, 20, 40)}


def test_the_text_of_what_stays_and_its_comments_stay() -> None:
    before = spec(GRID)
    text = refined(before, Extension({"n": (10, 20)}, 2, 5))
    assert text == (
        f"{HEAD}sweep:\n- separation_weight: {{linspace: [0, 1, 5]}}  # five\n"
        "  n: [10, 20, 40]\n"
        "- separation_weight: {linspace: [0, 1, 5]}\n  n: [10, 15, 20]\n"
        "replicates: 5   # for a start\nrecord: {metrics: [speed]}\n"
    )


def test_a_box_adds_only_what_lies_in_it() -> None:
    before = spec(GRID)
    box = {"separation_weight": (0.0, 0.25), "n": (20.0, 40.0)}
    new = points(finer(before, between=box, parts=2)) - points(before)
    assert new == {(0.125, 20), (0.125, 30), (0.125, 40), (0.0, 30), (0.25, 30)}


def test_a_point_divides_the_intervals_beside_it() -> None:
    before = spec(GRID)
    after = finer(before, between={"separation_weight": (0.5, 0.5)}, parts=5)
    new = {one for one, _ in points(after) - points(before)}
    assert new == {0.3, 0.35, 0.4, 0.45, 0.55, 0.6, 0.65, 0.7}


def test_an_end_that_a_page_has_rounded_is_the_value_that_it_was() -> None:
    before = spec("  separation_weight: {linspace: [0, 1, 7]}\n  n: [10, 20]\n")
    third, half = 0.333333, 0.5
    after = finer(before, between={"separation_weight": (third, half)}, parts=2)
    new = {round(one, 9) for one, _ in points(after) - points(before)}
    assert new == {round(5 / 12, 9)}
    box = {"separation_weight": (0.666667, 0.666667), "n": (10.0, 20.0)}
    new = points(finer(before, between=box, parts=2)) - points(before)
    beside = {0.5, 7 / 12, 2 / 3, 0.75, 5 / 6}  # of n = 15, which is new
    assert {round(one, 9) for one, _ in new} == {round(one, 9) for one in beside}


def test_a_refined_study_is_refined_again_where_it_is_finest() -> None:
    once = finer(spec(GRID), between={"separation_weight": (0.0, 0.25)}, parts=2)
    twice = finer(once, between={"separation_weight": (0.0, 0.1)}, parts=2)
    assert {one for one, _ in points(twice) - points(once)} == {0.0625}


def test_a_logarithmic_axis_is_divided_by_equal_ratios() -> None:
    before = spec("  separation_weight: {logspace: [0.01, 1, 3]}\n")
    wanted = Extension(
        {"separation_weight": (0.01, 1)}, 2, logarithmic={"separation_weight"}
    )
    new = points(study_of(refined(before, wanted))) - points(before)
    assert new == {(0.0316227766017,), (0.316227766017,)}


def test_what_is_drawn_is_drawn_again_from_the_region_alone() -> None:
    before = spec(
        "  weights:\n    sample: sobol\n    points: 32\n"
        "    separation_weight: {uniform: [0, 2]}\n"
        "    alignment_weight: {loguniform: [0.01, 1]}\n"
        "    n: {integers: [10, 90]}\n"
    )
    box = {"separation_weight": (0.5, 1.0), "n": (20.5, 60.0)}
    new = points(finer(before, between=box, parts=3)) - points(before)
    there = [
        one for one in points(before) if 0.5 <= one[0] <= 1 and 20.5 <= one[2] <= 60
    ]
    assert len(new) == 2 * len(there) > 0
    assert all(0.5 <= one <= 1 and 21 <= n <= 60 for one, _, n in new)
    assert any(one[1] < 0.1 for one in new)


def test_a_condition_of_an_axis_stays() -> None:
    before = spec(
        "  n: [10, 20]\n  separation_weight: {values: [0, 1], when: n > 10}\n"
    )
    after = finer(before, between={"separation_weight": (0, 1)}, parts=2)
    assert {n for n, one in points(after) if one == 0.5} == {20}


@pytest.mark.parametrize(
    ("sweep", "wanted", "why"),
    [
        (GRID, Extension({}), "the refinement is empty"),
        (GRID, Extension({"n": (1, 5)}), "no segment is between 1 and 5"),
        (GRID, Extension({"n": (5, 1)}), "5 to 1 is not a region"),
        (GRID, Extension({"n": (10, 20)}, 1), "parts: 1 is not allowed"),
        (GRID, Extension({"n": (10, 20)}, 101), "parts: 101 is not allowed"),
        (GRID, Extension({"nn": (1, 2)}), 'unknown varying parameter "nn"'),
        (GRID, Extension({"speed": (1, 2)}), "varying parameter"),
        (GRID, Extension({}, 2, 3), "the spec has 3 replicates; give more, not 3"),
        ("  n: [10, 11]\n", Extension({"n": (10, 11)}), "no integer is between"),
        (
            "  borders: [torus, bounded]\n",
            Extension({"borders": (0, 1)}),
            "only numbers can be refined",
        ),
        (
            "  both: {zip: {n: [10, 20], separation_weight: [0, 1]}}\n",
            Extension({"n": (10, 20)}),
            "varies several parameters together",
        ),
        (
            DRAWN.replace("uniform", "normal"),
            Extension({"separation_weight": (0, 1)}),
            "cannot draw from a region of this distribution",
        ),
        (
            DRAWN,
            Extension({"separation_weight": (3, 4)}),
            "3 to 4 is outside the distribution; the spec draws from 1 to 2",
        ),
        (
            f"  n: [10, 20]\n{DRAWN}",
            Extension({"n": (10, 20)}),
            '"some" would draw new points in a further design',
        ),
        (
            "  all: {sample: morris, points: 4, n: {integers: [10, 90]},"
            " separation_weight: {uniform: [1, 2]}}\n",
            Extension({"separation_weight": (1, 2)}),
            '"all" counts only as a whole',
        ),
        (
            "  detail: {ablate: as_written}\n",
            Extension({"start_speed": (1, 2)}),
            "counts only as a whole",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_words(
    sweep: str, wanted: Extension, why: str
) -> None:
    with pytest.raises(ChoiceError, match=why):
        refined(spec(sweep), wanted)


@pytest.mark.parametrize(
    ("foot", "why"),
    [
        ("seeds: [1, 2]\nrecord: {metrics: [speed]}\n", "the spec lists seeds"),
        (
            "replicates: {until: {metric: speed, half_width: 1}, max: 30}\n"
            "record: {metrics: [speed]}\n",
            "a rule decides the number",
        ),
        (
            BOUNDARY,
            'change max under "refine"',
        ),
    ],
)
def test_replicates_that_are_no_number_stay(foot: str, why: str) -> None:
    with pytest.raises(ChoiceError, match=why):
        refined(spec(GRID, foot), Extension({}, replicates=9))


def test_a_grid_that_becomes_finer_by_itself_is_left_alone() -> None:
    with pytest.raises(ChoiceError, match='"refine" in the spec chooses the points'):
        refined(spec(GRID, BOUNDARY), Extension({"n": (10, 20)}))
