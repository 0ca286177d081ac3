"""Comparisons of stored studies by hand, and of made-up ones whose truth is known."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom, nct, t, ttest_ind, ttest_rel

from sweep.analysis import (
    equivalence,
    holm,
    independent_contrast,
    max_t,
    mean_estimate,
    paired_contrast,
)
from sweep.campaigns.design_plan import plan_table
from sweep.cli import main
from sweep.cli.reporting import print_report
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.figures import paired_effects
from sweep.methods.comparison import (
    Comparison,
    Inference,
    Side,
    compare_sides,
    comparison_report,
    judge,
    match,
    read_side,
)
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from tests.cases import slow_but
from tests.sampled import MadeUp
from tests.specs import short
from tests.studies import SMALL, launched

SIZES = SMALL.replace("study: small", "study: sizes").replace(
    "{n: 12, steps: 9}", "{steps: 9}"
)
SIZES = SIZES.replace("separation_weight: [0.5, 1]", "n: [8, 12]")
OTHERS = SIZES.replace("study: sizes", "study: others").replace(
    "[8, 12]", "[12, 16, 8]"
)
OTHERS = OTHERS.replace("{steps: 9}", "{steps: 9, drag: 0.3}").replace(
    "replicates: 3", "replicates: 4"
)
ABLATING = SMALL.replace("study: small", "study: ablating").replace(
    "steps: 9", "steps: 9, n_obstacles: 2"
)
ABLATING = ABLATING.replace(
    "separation_weight: [0.5, 1]",
    "detail: {ablate: as_written}\n  cohesion_weight: [1, 2]",
)
FALSE_ALARM = 1e-4
"""The chance that a statistical test here fails although all is well, two-sided."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("compared")
    for spec in (SMALL, SIZES, OTHERS, ABLATING):
        launched(spec, folder)
    return folder


def compared(results: Path, a: str, b: str, *metrics: str, **method: Any) -> Comparison:
    return compare_sides(
        read_side(a, results),
        read_side(b, results),
        metrics,
        method=Inference(**method),
    )


def speeds(results: Path, study: str, **settings: object) -> np.ndarray:
    """The speeds of a point by replicate."""
    trials = StoredStudy(study, results).trials
    for name, value in settings.items():
        trials = trials[trials[name] == value]
    return trials.sort_values("replicate")["speed"].to_numpy()


def test_two_studies_are_matched_by_n_and_paired_by_replicate(results: Path) -> None:
    """OTHERS has a fourth replicate and a size without partner, and its sizes in
    another order.
    """
    found = compared(results, "sizes", "others", "speed")
    assert list(found.rows["n"]) == [8, 12]
    assert (found.matching.names, found.matching.same) == (["n"], 0)
    assert [list(alone["n"]) for alone in found.matching.alone] == [[], [16]]
    assert found.matching.differ == {"drag": ([0.1], [0.3])}
    p_values = []
    for (_, row), n in zip(found.rows.iterrows(), (8, 12), strict=True):
        before, after = (
            speeds(results, "sizes", n=n),
            speeds(results, "others", n=n)[:3],
        )
        expected = ttest_rel(after, before)
        assert (row["a"], row["b"]) == pytest.approx((before.mean(), after.mean()))
        assert row["difference"] == pytest.approx((after - before).mean())
        assert (row["low"], row["high"]) == pytest.approx(
            tuple(expected.confidence_interval(0.975))
        )
        reduction = (before.var(ddof=1) + after.var(ddof=1)) / (after - before).var(
            ddof=1
        )
        assert row["variance_reduction"] == pytest.approx(reduction)
        assert (
            row["paired"],
            row["n_a"],
            row["n_b"],
            row["trials_a"],
            row["trials_b"],
        ) == (True, 3, 3, 3, 4)
        p_values.append(expected.pvalue)
    assert list(found.rows["p"]) == pytest.approx(list(holm(p_values)))


def test_the_presets_of_an_ablation_have_the_effect_of_all_details(
    results: Path,
) -> None:
    found = compared(results, "ablating:as_run", "ablating:as_written", "speed")
    effects = paired_effects(
        StoredStudy("ablating", results), "as_written", ["speed"], "cohesion_weight"
    )
    expected = effects[effects["detail"] == "all"].set_index("cohesion_weight")["value"]
    assert dict(
        zip(found.rows["cohesion_weight"], found.rows["difference"], strict=True)
    ) == pytest.approx(expected.to_dict())
    assert {"drag", "borders", "start_speed"} <= set(found.matching.differ)
    alone = compared(
        results,
        "ablating:as_run,cohesion_weight=2",
        "ablating:detail=drag,cohesion_weight=2",
        "speed",
    )
    assert len(alone.rows) == 1
    assert alone.matching.differ == {"drag": ([0.1], [0.0])}
    drag = effects[(effects["detail"] == "drag") & (effects["cohesion_weight"] == 2)][
        "value"
    ].item()
    assert alone.rows["difference"].item() == pytest.approx(drag)


def test_two_values_in_one_study_are_matched_on_all_else(results: Path) -> None:
    """Of the 22 points, those without another change and those with all changes differ;
    no other has its partner.
    """
    found = compared(results, "ablating:drag=0.1", "ablating:drag=0", "speed")
    assert (len(found.rows), [len(alone) for alone in found.matching.alone]) == (
        2,
        [18, 2],
    )
    assert set(found.matching.differ) == {"drag"}
    same = compared(
        results,
        "ablating:drag=0.1,cohesion_weight=1",
        "ablating:drag=0.1,cohesion_weight=2.0",
        "speed",
    )
    assert (len(same.rows), set(same.matching.differ)) == (10, {"cohesion_weight"})


def test_means_over_the_last_half(results: Path) -> None:
    sides = (
        read_side("small:separation_weight=0.5", results),
        read_side("small:separation_weight=1", results),
    )
    found = compare_sides(*sides, ["speed"], half=True).rows
    trials = sides[0].trials
    assert (found["metric"].item(), found["unit"].item()) == ("speed_mean", "px/step")
    assert found["a"].item() == pytest.approx(trials["speed_mean"].mean())


class Made(MadeUp):
    """A study of SHORT with these points and speeds, stored nowhere."""

    def __init__(
        self,
        name: str,
        *lines: str,
        speed: Callable[[pd.DataFrame], np.ndarray],
        kernels: str = "k",
    ) -> None:
        text = short("record: {metrics: [speed]}", *lines).replace(
            "study: short", f"study: {name}"
        )
        spec = parse_spec(
            text.replace("replicates: 2\n", "") if "seeds: " in text else text
        )
        design = expand(spec)
        about: dict[str, object] = {
            "kernels_sha": kernels,
            "model": spec.model,
            "preset": spec.preset,
        }
        plan = plan_table(Jobs(spec, design), about)
        super().__init__(plan, np.zeros(plan.num_rows))
        streams = spec.streams
        others = {
            key: value for key, value in design.base.items() if key not in self.trials
        }
        self.name = name
        self.trials = self.trials.assign(
            **others,
            model=spec.model,
            preset=spec.preset,
            every=1,
            seed_listed=spec.seeds is not None,
            streams=(
                f"start={streams.start} world={streams.world} noise={streams.noise}"
            ),
        )
        self.trials["speed"] = speed(self.trials)

    def side(self) -> Side:
        """All its points."""
        return Side(self.name, self, self.trials, frozenset())


APART = "streams: {start: independent, world: independent}"


def pair(points: int, replicates: int, *lines: str) -> tuple[Side, Side]:
    """Two studies with the same points, whose speeds are zero."""
    sweep = f"sweep: {{separation_weight: {{linspace: [1, 2, {points}]}}}}"

    def made(name: str, *more: str) -> Side:
        return Made(
            name, sweep, *more, speed=lambda trials: np.zeros(len(trials))
        ).side()

    more = [*lines, f"seeds: {list(range(1, replicates + 1))}"]
    return made("one", *more), made("other", *more, "fixed: {drag: 0.3}")


def with_speeds(side: Side, speed: np.ndarray) -> Side:
    """The same trials with other results, (points, replicates)."""
    return replace(side, trials=side.trials.assign(speed=speed.ravel()))


def drawn(
    rng: np.random.Generator,
    points: int,
    n: int,
    effect: float,
    shared: float,
    *,
    common: bool,
) -> np.ndarray:
    """Normal values (2, points, n) with variance 1 + shared^2; where `common`, both
    sides have the second part alike.

    Those of the second side are larger by `effect`.
    """
    starts = shared * rng.normal(size=(2, points, n))
    values = (starts[:1] if common else starts) + rng.normal(size=(2, points, n))
    values[1] += effect
    return np.asarray(values)


def judged(values: np.ndarray, *, common: bool) -> pd.DataFrame:
    """The verdicts of a table, (2, points, n)."""
    pairs = [
        paired_contrast(pd.Series(before), pd.Series(after))
        for before, after in zip(*values, strict=True)
    ]
    apart = [
        independent_contrast(before, after)
        for before, after in zip(*values, strict=True)
    ]
    return judge(pairs if common else apart, Inference())


def bounds(chance: float, number: int) -> tuple[float, float]:
    """Between which shares of `number` tries one lies, but for FALSE_ALARM."""
    low, high = binom.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], number, chance)
    return float(low) / number, float(high) / number


@pytest.mark.parametrize("tables", slow_but([50], [50, 250, 1000]))
@pytest.mark.parametrize("common", [True, False], ids=["paired", "apart"])
def test_a_table_without_any_difference_has_a_wrong_verdict_one_time_in_twenty(
    common: bool, tables: int
) -> None:
    """Tables of 4 independent points: 1 - (1 - 0.05/4)^4 by Holm, and by the intervals;
    false alarm 1e-4.
    """
    rng, wrong = np.random.default_rng(11), []
    for _ in range(tables):
        found = judged(drawn(rng, 4, 10, 0.0, 1.0, common=common), common=common)
        wrong.append((found["verdict"] != "no difference shown").any())
        assert wrong[-1] == ((found["low"] > 0.0) | (found["high"] < 0.0)).any()
    low, high = bounds(1 - (1 - 0.05 / 4) ** 4, tables)
    assert low <= np.mean(wrong) <= high


@pytest.mark.slow
def test_pairs_find_what_independent_trials_do_not() -> None:
    """Noncentral t: n = 12, effect 1, variances 1 and 3 of what pairs share; 300 tables
    each, false alarm 1e-4.
    """
    rng, n, powers = np.random.default_rng(12), 12, {}
    for common, freedom, variance in ((True, n - 1, 2.0), (False, 2 * n - 2, 8.0)):
        tables = [
            drawn(rng, 1, n, 1.0, np.sqrt(3.0), common=common) for _ in range(300)
        ]
        rows = [judged(values, common=common).iloc[0] for values in tables]
        low, high = bounds(
            float(nct.sf(t.ppf(0.975, freedom), freedom, 1 / np.sqrt(variance / n))),
            300,
        )
        powers[common] = np.mean([row["verdict"] == "higher" for row in rows])
        assert low <= powers[common] <= high
        if common:  # 8/2 is var(unpaired)/var(paired)
            assert 3.0 < np.median([row["variance_reduction"] for row in rows]) < 5.0
    assert powers[True] > 2 * powers[False]


def stored(
    rng: np.random.Generator, points: int, n: int, *lines: str
) -> tuple[Side, Side]:
    """`pair` with speeds drawn, B larger by a half."""
    values = drawn(rng, points, n, 0.5, 1.0, common=not lines)
    one, other = pair(points, n, *lines)
    return with_speeds(one, values[0]), with_speeds(other, values[1])


def test_trials_that_share_no_random_numbers_are_compared_by_welch() -> None:
    sides = stored(np.random.default_rng(13), 2, 6, APART)
    found = compare_sides(*sides, ["speed"])
    assert found.streams == ()
    point = sides[0].trials["separation_weight"] == 2.0
    expected = ttest_ind(
        sides[1].trials[point]["speed"],
        sides[0].trials[point]["speed"],
        equal_var=False,
    )
    row = found.rows[found.rows["separation_weight"] == 2.0].iloc[0]
    assert (row["low"], row["high"]) == pytest.approx(
        tuple(expected.confidence_interval(0.975))
    )
    assert not row["paired"]
    assert np.isnan(row["variance_reduction"])


def seeded(seeds: list[int], *lines: str) -> Side:
    """One point; the speed of a trial is its seed."""
    return Made(
        f"seeds_{seeds[0]}",
        f"seeds: {seeds}",
        *lines,
        speed=lambda trials: trials["seed"].to_numpy(),
    ).side()


def test_listed_seeds_are_paired_whatever_their_order() -> None:
    found = compare_sides(
        seeded([4, 2, 9]), seeded([9, 4, 2, 5], "fixed: {drag: 0.3}"), ["speed"]
    ).rows.iloc[0]
    assert (found["difference"], found["n_a"]) == (0.0, 3)
    assert found["variance_reduction"] == np.inf
    assert np.isnan([found["low"], found["high"], found["p"]]).all()


def test_equal_values_of_a_side_are_no_test(capsys: pytest.CaptureFixture[str]) -> None:
    """Forty equal ones, against others with another mean."""
    one, other = pair(2, 40, APART)
    values = np.random.default_rng(1).normal(1.0, 0.1, (2, 40))
    found = compare_sides(one, with_speeds(other, values), ["speed"])
    assert list(found.rows["verdict"]) == ["too few distinct values"] * 2
    assert found.tests == 0
    print_report(comparison_report(found))
    assert "no test in 2 rows" in " ".join(capsys.readouterr().out.split())


def test_few_partners_leave_the_samples_independent_and_the_partners_out() -> None:
    found = compare_sides(
        seeded([1, 2, 3]), seeded([3, 7, 8], "fixed: {drag: 0.3}"), ["speed"]
    ).rows.iloc[0]
    assert (found["paired"], found["n_a"], found["n_b"]) == (False, 3, 2)
    assert (found["a"], found["b"]) == (2.0, 7.5)


def test_a_trial_that_is_not_done_takes_its_partner_along_and_is_counted() -> None:
    one, other = stored(np.random.default_rng(14), 2, 5)
    lost = other.trials.index[other.trials["separation_weight"] == 1.0][2]
    other.trials.loc[lost, "status"] = "diverged"
    found = compare_sides(one, other, ["speed"]).rows.set_index("separation_weight")
    assert list(found.loc[1.0, ["n_a", "n_b", "not_done_a", "not_done_b"]]) == [
        4,
        4,
        0,
        1,
    ]
    assert list(found.loc[2.0, ["n_a", "n_b", "not_done_a", "not_done_b"]]) == [
        5,
        5,
        0,
        0,
    ]
    left = np.arange(5) != 2
    before, after = (
        side.trials[side.trials["separation_weight"] == 1.0]["speed"].to_numpy()
        for side in (one, other)
    )
    assert found.loc[1.0, "difference"] == pytest.approx((after - before)[left].mean())


def test_verdicts_with_a_margin() -> None:
    """Large, small but certain, none, and too uncertain to say: with noise in
    proportion.
    """
    rng = np.random.default_rng(15)
    noise = rng.normal(size=(4, 12))
    noise -= noise.mean(axis=1, keepdims=True)
    differences = (
        np.array([5.0, -0.3, 0.0, 0.4])[:, None]
        + np.array([0.1, 0.1, 0.1, 5.0])[:, None] * noise
    )
    sides = pair(4, 12)
    one, other = (
        with_speeds(sides[0], np.zeros((4, 12))),
        with_speeds(sides[1], differences),
    )
    found = compare_sides(one, other, ["speed"], method=Inference(margin=1.0))
    assert list(found.rows["verdict"]) == [
        "higher",
        "lower, equivalent",
        "equivalent",
        "no difference shown",
    ]
    alone = [equivalence(mean_estimate(values), -1.0, 1.0).p for values in differences]
    assert list(found.rows["p_equivalent"]) == pytest.approx(list(holm(alone)))
    assert found.verdicts("speed") == dict.fromkeys(
        ["higher", "lower, equivalent", "equivalent", "no difference shown"], 1
    )
    together = compare_sides(
        one, other, ["speed"], method=Inference(together="max_t", confidence=0.9)
    ).rows
    assert list(together["high"]) == pytest.approx(list(max_t(differences.T, 0.9).high))
    one_each = compare_sides(
        seeded([1]), seeded([1], "fixed: {drag: 0.3}"), ["speed"]
    ).rows
    assert list(one_each["verdict"]) == ["too few distinct values"]


def test_what_is_not_known_is_a_dash(capsys: pytest.CaptureFixture[str]) -> None:
    sides = pair(2, 4)
    one, other = (
        with_speeds(sides[0], np.full((2, 4), np.nan)),
        with_speeds(sides[1], np.full((2, 4), np.nan)),
    )
    print_report(comparison_report(compare_sides(one, other, ["speed"])))
    printed = capsys.readouterr().out
    assert "nan" not in printed
    assert "too few" in printed


def test_the_number_of_boids_is_another_column_than_that_of_trials(
    results: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    print_report(comparison_report(compared(results, "sizes", "others", "speed")))
    lines = capsys.readouterr().out.splitlines()
    (heading,) = (line.split() for line in lines if "reduction " in line[:100])
    assert (heading[0], heading.count("n"), heading.count("trials")) == ("n", 1, 1)


def test_what_else_differs_is_said() -> None:
    zero: Any = {"speed": lambda trials: np.zeros(len(trials))}
    one = Made("one", "sweep: {n: [10, 20]}", **zero).side()
    other = Made(
        "other",
        "sweep: {n: [10, 20], steps: [100, 200]}",
        "fixed: {borders: open}",
        kernels="new",
        **zero,
    )
    side = other.side()
    chosen = Side(
        "other:steps=100",
        other,
        side.trials[side.trials["steps"] == 100],
        frozenset({"steps"}),
    )
    differ = match(one, chosen).differ
    assert set(differ) == {"kernels", "borders", "steps"}
    assert differ["kernels"] == (["k"], ["new"])
    again = Made("again", "sweep: {n: [10, 20]}", kernels="new", **zero).side()
    assert set(match(one, again).differ) == {"kernels"}


def run(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    results: Path,
    *words: str,
) -> str:
    """What `sweep compare` prints."""
    monkeypatch.setattr(
        sys, "argv", ["sweep", "compare", *words, "--results", str(results)]
    )
    with pytest.raises(SystemExit) as ending:
        main()
    captured = capsys.readouterr()
    assert ending.value.code == (2 if captured.err else 0)
    return captured.err or captured.out


def test_text_csv_and_json_have_the_same_numbers(
    results: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("sizes", "others", "--metric", "speed", "--margin", "0.2")
    rows = compared(results, "sizes", "others", "speed", margin=0.2).rows
    csv = pd.read_csv(StringIO(run(capsys, monkeypatch, results, *words, "--csv")))
    pd.testing.assert_frame_equal(csv, rows, check_dtype=False, check_exact=True)
    found = json.loads(run(capsys, monkeypatch, results, *words, "--json"))
    assert pd.DataFrame(found["rows"]).to_csv() == rows.to_csv()
    assert (
        found["method"]["comparisons"],
        found["method"]["together"],
        found["b"]["trials"],
    ) == (2, "holm", 12)
    assert (found["rows"][0]["unit"], found["b"]["without_partner"]) == (
        "px/step",
        [{"n": 16}],
    )
    text = run(capsys, monkeypatch, results, *words)
    assert f"{rows['a'][0]:.2f}"[:4] in text
    assert "without partner: 1 of B: n = 16" in text
    assert "A and B differ in drag (0.1; 0.3)" in text
    assert "all 2 confidence intervals are simultaneous (Bonferroni)" in text
    assert "speed, B against A: " in text
    assert max(map(len, text.split("±: half")[0].splitlines())) <= 100


def test_json_has_no_number_that_json_lacks() -> None:
    sides = seeded([4, 2, 9]), seeded([9, 4, 2, 5], "fixed: {obstacle_range: .inf}")
    found = json.loads(
        comparison_report(compare_sides(*sides, ["speed"])).to_json(),
        parse_constant=pytest.fail,
    )
    assert (
        found["rows"][0]["variance_reduction"],
        found["differ"]["obstacle_range"]["b"],
    ) == ("inf", ["inf"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("small smal", 'launched here; did you mean "small"?'),
        (
            "small:speration_weight=1 small",
            'unknown parameter "speration_weight"; did you mean "separation_weight"?',
        ),
        (
            "small:separation_weight=2 small",
            "no point has separation_weight = 2; values of separation_weight: 0.5, 1",
        ),
        (
            "small:n=many small",
            "no point has n = many; values of n: 12",
        ),
        (
            "small:borders=toros small",
            'no point has borders = toros; did you mean "torus"? Values of borders:',
        ),
        (
            "small: small",
            '"" chooses nothing; allowed: SETTING=VALUE[,SETTING=VALUE], for example',
        ),
        ("small:n=12,n=12 small", "n is given twice; allowed: one value"),
        ("small:n=12,separation_weight=1 small:n= ", 'no point has n = ""'),
        (
            "ablating:as_writen small",
            (
                'unknown preset "as_writen"; did you mean "as_written"? Allowed:'
                " as_run, as_written; or name parameters, for example obstacle_range="
            ),
        ),
        (
            "small:as_written small",
            "the study ablates no preset: name parameters, for example"
            " separation_weight=0.5",
        ),
        (
            "ablating:detail=drug small",
            'no point has detail = drug; did you mean "drag"? Values of detail: "",',
        ),
        (
            "ablating:as_run,drag=0 small",
            'no point with detail = "" has drag = 0; values of drag: 0.1',
        ),
        (
            "ablating:detail=drag,cohesion_weight=1,n=12 small --metric sped",
            'unknown metric "sped"; did you mean "speed"?',
        ),
        (
            "small small",
            "small and small are identical trials: there is nothing to compare",
        ),
        (
            "small small:separation_weight=1",
            "agree only in identical trials",
        ),
        ("others:n=16 sizes", "differ in n: choose a value, for example sizes:n=8"),
        (
            "sizes others --margin 1",
            "a margin is in the unit of a single metric: choose a metric from speed",
        ),
        (
            "sizes others --margin 0 --metric speed",
            "margin: 0; allowed: a number above 0",
        ),
        (
            "sizes others --confidence 95",
            "confidence: 95; allowed: from 0.5 to below 1, such as 0.95",
        ),
        ("sizes others --together max_t", "max_t: 3 replicates; allowed: 10 or more"),
    ],
)
def test_what_is_wrong_is_one_line(
    results: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: str,
    message: str,
) -> None:
    error = run(capsys, monkeypatch, results, *words.split())
    assert message in error
    assert error.count("\n") == 1
