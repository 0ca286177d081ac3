"""Samples in blocks have the structure that their analyses need, and say so where the
spec would break it.
"""

import sys

import numpy as np
import pytest
from scipy.stats import norm

from sweep.design.plan import make_plan
from sweep.errors import SpecError
from sweep.spec.axes import Axis
from sweep.spec.study import parse_spec
from sweep.spec.whole_samples import TAIL
from tests.sampled import SETTINGS, axis
from tests.specs import short, short_study

MIXED = (
    "joint: {{sample: {sample}, points: 16, separation_weight: {{loguniform: [0.1,"
    " 10]}}, alignment_weight: {{normal: [1, 0.2]}}, n: {{integers: [3, 6]}}, map:"
    " {{choice: [empty, cafeteria]}}}}"
)


def joint(sweep: str) -> Axis:
    return next(
        axis for axis in short_study(f"sweep: {{{sweep}}}").axes if axis.name == "joint"
    )


def blocks(found: Axis, settings: tuple[str, ...] = SETTINGS) -> np.ndarray:
    """The points of the axis in the order of its blocks, (blocks, size, settings)."""
    points = np.stack([found.columns[setting] for setting in settings], axis=1)[
        found.rows
    ]
    return points.reshape(found.blocks.count, found.blocks.size, len(settings))


def test_a_block_of_saltelli_crosses_two_points() -> None:
    found = blocks(joint(axis("saltelli", 8)))
    assert found.shape == (8, 8, 3)
    a, b = found[:, 0], found[:, -1]
    assert (a != b).all()
    for setting in range(3):
        others = [other for other in range(3) if other != setting]
        for row, one, other in ((1 + setting, a, b), (4 + setting, b, a)):
            np.testing.assert_array_equal(found[:, row, setting], other[:, setting])
            np.testing.assert_array_equal(found[:, row, others], one[:, others])


def test_without_pairs_a_block_is_shorter() -> None:
    short_ones, long_ones = (
        blocks(joint(axis("saltelli", 8, second_order="false"))),
        blocks(joint(axis("saltelli", 8))),
    )
    np.testing.assert_array_equal(short_ones, long_ones[:, [0, 1, 2, 3, -1]])


@pytest.mark.parametrize("levels", [4, 6])
def test_a_trajectory_of_morris_changes_every_field_once_by_half_of_the_levels(
    levels: int,
) -> None:
    found = blocks(joint(axis("morris", 20, levels=levels)))
    assert found.shape == (20, 4, 3)
    steps = np.diff(found, axis=1)
    assert (np.count_nonzero(steps, axis=2) == 1).all()
    assert (np.count_nonzero(steps, axis=1) == 1).all()
    np.testing.assert_allclose(
        np.abs(steps[steps != 0]), levels / 2 / (levels - 1), rtol=1e-12
    )
    assert set(found.ravel()) == {level / (levels - 1) for level in range(levels)}


@pytest.mark.parametrize("sample", ["saltelli", "morris"])
def test_samples_are_reproducible_and_more_blocks_keep_the_old_ones(
    sample: str,
) -> None:
    few, many = blocks(joint(axis(sample, 5))), blocks(joint(axis(sample, 40)))
    np.testing.assert_array_equal(few, blocks(joint(axis(sample, 5))))
    np.testing.assert_array_equal(few, many[:5])
    other = short_study(f"sweep: {{{axis(sample, 5).replace('joint', 'other')}}}").axes[
        0
    ]
    assert (blocks(other) != few).any()


def test_all_distributions_suit_both_samplers() -> None:
    for sample in ("saltelli", "morris"):
        found = joint(MIXED.format(sample=sample))
        assert set(found.columns["n"]) == {3, 4, 5, 6}
        assert set(found.columns["map"]) == {"empty", "cafeteria"}
        assert (
            0.1
            <= found.columns["separation_weight"].min()
            < found.columns["separation_weight"].max()
            <= 10
        )
        assert found.merged == len(found.rows) - len(found) > 0
        assert len(np.unique(found.rows)) == len(found)
    # Morris: the tails of the normal distribution are cut at 0.5 and 99.5 %, its levels
    # are quantiles.
    expected = norm.ppf(TAIL + (1 - 2 * TAIL) * np.arange(4) / 3, 1, 0.2)
    np.testing.assert_allclose(
        np.unique(found.columns["alignment_weight"]), expected, rtol=1e-4
    )
    assert set(found.columns["separation_weight"].round(6)) == {
        0.1,
        0.464159,
        2.154435,
        10,
    }


def test_the_plan_says_how_many_points_there_are() -> None:
    flat = "fixed: {borders: open}"
    axes = f"sweep: {{n: [3, 4], {axis('saltelli', 12)}}}"
    plan = make_plan(short_study(flat, axes), 1)
    assert plan.points == 2 * 12 * 8
    assert plan.notes == (
        "joint: 12 blocks of 8 points each are 96 points",
        "joint: a Sobol sequence is most even for a power of two, not for 12 points",
    )
    axes = f"sweep: {{{axis('morris', 10)}}}"
    (note,) = make_plan(short_study(flat, axes), 1).notes
    assert note == "joint: 10 trajectories of 4 points each are 40 points"


MISTAKES = [
    (
        [axis("saltelli", 8, when="n > 1")],
        "6: a saltelli sample cannot have when: the analysis needs all points",
    ),
    ([axis("morris", 8, levels=5)], '6: "levels" must be an even number'),
    (
        [axis("morris", 8, levels=1)],
        '6: "levels" must be an integer from 2 to 1000, not 1',
    ),
    ([axis("saltelli", 8, levels=4)], '6: unknown key "levels"'),
    (
        [axis("saltelli", 8, second_order=1)],
        '6: "second_order" must be true or false, not 1',
    ),
    (
        [axis("saltelli", 1)],
        '6: "points" must be an integer from 2 to 10000000, not 1',
    ),
    (["joint: {sample: morris, points: 8}"], '6: "joint" samples no parameter'),
    (
        [axis("saltelli", 2_000_000)],
        (
            "6: 2,000,000 times 2 D + 2 for D = 3 parameters makes 16,000,000 points;"
            " at most 10,000,000 are allowed"
        ),
    ),
    (
        [
            axis("saltelli", 8),
            axis("morris", 8).replace("joint", "two").replace("weight", "range"),
        ],
        '6: "joint" is already a sample of blocks',
    ),
    (
        [axis("saltelli", 8), "n: {values: [3, 4], when: cohesion_weight > 0.5}"],
        "6: when cannot use parameters of",
    ),
]


@pytest.mark.parametrize(
    ("axes", "message"), MISTAKES, ids=[axes[-1][:40] for axes, _ in MISTAKES]
)
def test_mistakes_are_named_with_their_line(axes: list[str], message: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(short(f"sweep: {{{', '.join(axes)}}}"))
    assert str(error.value).startswith(f"spec.yaml:{message}")


def test_a_condition_may_not_reject_points_of_a_block() -> None:
    lines = [f"sweep: {{{axis('saltelli', 8)}}}", "require: [cohesion_weight < 0.9]"]
    with pytest.raises(
        SpecError,
        match=(
            r'7: require could reject points of "joint": a saltelli sample needs all'
        ),
    ):
        parse_spec(short(*lines))


def test_a_condition_on_other_axes_is_no_obstacle() -> None:
    study = short_study(
        "sweep: {n: [3, 4], steps: {values: [5, 6], when: n > 3},"
        f" {axis('morris', 4)}}}"
    )
    assert len(study.axes) == 3


def test_salib_is_only_needed_for_these_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "SALib", None)
    short_study(f"sweep: {{{axis('sobol', 8)}}}")
    with pytest.raises(
        SpecError,
        match=r'6: sample: morris needs the package SALib, .*: pip install "boidsw',
    ):
        short_study(f"sweep: {{{axis('morris', 8)}}}")
