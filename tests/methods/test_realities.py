"""The reality gap: of made-up scores whose laws are known, and of stored studies."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from numpy.random import Generator, default_rng

from sweep.analysis import Declaration, Declared, Interval, mean_interval
from sweep.campaigns.design_plan import plan_table
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError
from sweep.methods.realities import gap_report, reality_gap
from sweep.methods.realities.analysis import RealityGap, scores_of
from sweep.methods.realities.estimates import (
    crossed_estimate,
    crossed_interval,
    difference_interval,
    lost_fraction,
    worst_mean,
)
from sweep.methods.realities.figure import draw_gap
from sweep.methods.realities.surrogate import sobol_indices
from sweep.spec.study import parse_spec
from tests.commands import sweep as command
from tests.sampled import FIRST, SETTINGS, TOTAL, MadeUp, ishigami
from tests.specs import short
from tests.studies import launched, relaunch

Function = Callable[[pd.DataFrame], np.ndarray]
LOSS = "packet_loss: {uniform: [0, 1]}"


def made_up(
    function: Function,
    imperfections: str = LOSS,
    *,
    draws: int = 50,
    replicates: int = 3,
    weights: str = "[1, 2]",
) -> MadeUp:
    """A study whose scores are a function of the settings, without noise."""
    text = short(
        f"realities: {{{imperfections}, draws: {draws}}}\n"
        f"sweep: {{separation_weight: {weights}}}"
    ).replace("replicates: 2", f"replicates: {replicates}")
    spec = parse_spec(text)
    design = expand(spec)
    values = np.repeat(function(pd.DataFrame(design.columns)), replicates)
    return MadeUp(plan_table(Jobs(spec, design), {}), values)


def noisy(study: MadeUp, rng: Generator, deviation: float = 1.0) -> MadeUp:
    """The study with noise of each trial, and of each replicate in common."""
    trials = study.trials
    common = rng.normal(0.0, deviation, trials["replicate"].max() + 1)
    noise = rng.normal(0.0, deviation, len(trials)) + common[trials["replicate"]]
    study.trials = trials.assign(speed=trials["speed"] + noise)
    return study


def crossing(settings: pd.DataFrame) -> np.ndarray:
    """Weight 1 is better without loss, by 0.6; from a loss of 0.3 on, weight 2 is."""
    first = settings["separation_weight"].to_numpy() == 1
    return np.where(first, 1.0 - 2.0 * settings["packet_loss"].to_numpy(), 0.4)


def weights_alone(settings: pd.DataFrame) -> np.ndarray:
    return settings["separation_weight"].to_numpy(dtype=float)


def test_scores_are_those_of_the_trials() -> None:
    study = made_up(crossing, draws=20)
    scores = scores_of(study, "speed")
    assert scores.controllers == ["separation weight = 1", "separation weight = 2"]
    assert scores.design.tolist() == [[1.0] * 3, [0.4] * 3]
    loss = scores.imperfections["packet_loss"].to_numpy()
    assert len(loss) == len({*loss}) == 20
    expected = np.stack([1.0 - 2.0 * loss, np.full(20, 0.4)])
    np.testing.assert_array_equal(
        scores.drawn, np.repeat(expected[:, :, None], 3, axis=2)
    )


def test_the_rank_changes_with_the_known_probability() -> None:
    """In 70 % of the realities the loss is above 0.3."""
    gap = reality_gap(made_up(crossing, draws=400), "speed+")
    (pair,) = gap.pairs
    loss = gap.scores.imperfections["packet_loss"]
    assert (pair.leader, pair.other) == (
        "separation weight = 1",
        "separation weight = 2",
    )
    assert pair.change.value == np.mean(loss > 0.3)
    assert pair.change.low < 0.7 < pair.change.high
    assert pair.change.high - pair.change.low < 0.1
    assert pair.design.value == pytest.approx(0.6)
    assert pair.realities.value == pytest.approx(0.6 - 2.0 * loss.mean())


def test_a_reversed_rank_is_found() -> None:
    study = noisy(made_up(crossing, draws=100, replicates=20), default_rng(1), 0.1)
    gap = reality_gap(study, "speed+")
    first, second = gap.controllers
    assert [pair.verdict for pair in gap.pairs] == ["reverses"]
    assert (first.verdict, second.verdict) == ("drops", "not decided")
    assert first.drop.low < 1.0 < first.drop.high
    assert second.drop.low < 0.0 < second.drop.high


def test_low_values_may_be_better() -> None:
    """Then everything is the other way round, and the worst tenth is the highest."""
    study = noisy(made_up(crossing, draws=100, replicates=20), default_rng(1), 0.1)
    high = reality_gap(study, "speed+")
    low = reality_gap(study, "speed-")
    assert (high.better, low.better) == ("high", "low")
    for one, other in zip(high.controllers, low.controllers, strict=True):
        assert one.drop.value == -other.drop.value
        assert one.drop.low == -other.drop.high
        assert one.worst_tenth.value < one.realities.value < other.worst_tenth.value
    assert low.controllers[0].verdict == "gains"
    assert low.pairs[0].leader == "separation weight = 2"
    assert low.pairs[0].verdict == "reverses"


def test_where_chooses_controllers_and_realities() -> None:
    study = made_up(crossing, draws=40)
    assert not reality_gap(study.where(separation_weight=1), "speed").pairs
    assert reality_gap(study.where("packet_loss < 0.5"), "speed").draws < 40
    with pytest.raises(ChoiceError, match="no trial of the design world"):
        reality_gap(study.where("packet_loss > 0"), "speed")
    with pytest.raises(ChoiceError, match="have no realities"):
        reality_gap(study.where(packet_loss=0), "speed")


def test_trials_without_a_value_are_left_out() -> None:
    study = made_up(crossing, draws=40)
    speed = study.trials["speed"].to_numpy(copy=True)
    speed[[0, 7, 8, 9, 10, 11]] = np.nan
    study.trials = study.trials.assign(speed=speed)
    gap = reality_gap(study, "speed+")
    assert gap.scores.without_value == 6
    assert gap.controllers[0].design.n == 2
    assert "6 trials without a value left out" in gap_report(gap).parts[0].caption


def lossy(settings: pd.DataFrame) -> np.ndarray:
    return settings["packet_loss"].to_numpy(dtype=float)


def test_a_missing_value_leaves_the_indices_without_noise() -> None:
    """Loss explains all of the variance, with the noise a quarter. One value of 122 is
    no reason for another index than 0.05 away.
    """
    study = noisy(
        made_up(lossy, draws=60, replicates=2, weights="[1]"), default_rng(4), 0.23
    )
    (complete,) = reality_gap(study, "speed+").controllers
    speed = study.trials["speed"].to_numpy(copy=True)
    speed[40] = np.nan
    study.trials = study.trials.assign(speed=speed)
    gap = reality_gap(study, "speed+")
    (lacking,) = gap.controllers
    indices = [float(each.indices.table["first"][0]) for each in (complete, lacking)]
    assert indices[0] > 0.9
    assert indices[1] == pytest.approx(indices[0], abs=0.05)
    assert lacking.indices.without_noise
    assert "without replicate noise" in gap_report(gap).to_latex()


def test_one_replicate_leaves_the_noise_in_the_indices() -> None:
    study = made_up(lossy, draws=60, replicates=1, weights="[1]")
    gap = reality_gap(noisy(study, default_rng(4), 0.1), "speed+")
    assert not gap.controllers[0].indices.without_noise
    assert "replicate noise included" in gap_report(gap).to_latex()


def test_one_replicate_decides_nothing() -> None:
    gap = reality_gap(made_up(crossing, replicates=1), "speed+")
    assert {each.verdict for each in gap.controllers} == {"not decided"}
    assert [pair.verdict for pair in gap.pairs] == ["not decided"]
    assert np.isnan(gap.controllers[0].drop.low)


def test_scores_of_a_declared_range_need_no_spread_in_the_design_world(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All robots arrive in the design world, and fewer in the realities."""
    monkeypatch.setattr(MadeUp, "distributions", {"speed": "proportion"})
    study = made_up(
        lambda settings: 1.0 - settings["packet_loss"].to_numpy(),
        draws=100,
        replicates=20,
        weights="[1]",
    )
    (only,) = reality_gap(study, "speed+").controllers
    assert only.design.value == 1.0
    assert only.verdict == "drops"
    assert 0.1 < only.drop.low < 0.5 < only.drop.high


def total_failure(settings: pd.DataFrame) -> np.ndarray:
    """Weight 1 arrives always without loss, and never with loss; weight 2 reversed."""
    is_first = settings["separation_weight"].to_numpy() == 1
    is_design = settings["packet_loss"].to_numpy() == 0.0
    return (is_first == is_design).astype(np.float64)


@pytest.mark.parametrize("declared", ["proportion", Declaration.of("normal", 0.0, 1.0)])
def test_a_total_failure_is_decided(
    monkeypatch: pytest.MonkeyPatch, declared: Declared
) -> None:
    """Ten replicates bound each mean; forty realities of the same replicates do not
    count as more. Without a declared range, equal values show no range.
    """
    monkeypatch.setattr(MadeUp, "distributions", {"speed": declared})
    study = made_up(total_failure, draws=40, replicates=10)
    gap = reality_gap(study, "speed+")
    first, second = gap.controllers
    assert (first.verdict, second.verdict) == ("drops", "gains")
    alone = mean_interval(np.zeros(10), 0.95, distribution=declared)
    assert first.realities == alone
    assert first.drop.value == -second.drop.value == 1.0
    assert 0.3 < first.drop.low < 1.0 - alone.high
    (pair,) = gap.pairs
    assert (pair.verdict, pair.realities.value, pair.change.value) == (
        "reverses",
        -1.0,
        1.0,
    )
    monkeypatch.setattr(MadeUp, "distributions", {"speed": "normal"})
    unknown = reality_gap(study, "speed+")
    assert {each.verdict for each in unknown.controllers} == {"not decided"}


def test_a_rounding_error_is_no_spread() -> None:
    """A sum of 0.1 and its parts differ by bits alone."""
    rows = np.where(np.arange(40) % 2, 0.1, np.nextafter(0.1, 1.0))
    assert np.isnan(crossed_interval(0.1, rows, np.full(3, 0.1), 0.95).low)


@pytest.mark.slow
def test_without_an_effective_imperfection_there_is_no_gap() -> None:
    """Of 400 studies of three controllers at most 5 % have any wrong drop or rank:
    up to 33 with a tolerance of 3 standard deviations.
    """
    study = made_up(weights_alone, draws=30, replicates=4, weights="[1, 1.5, 4]")
    speed = study.trials["speed"]
    alarms = 0
    for seed in range(400):
        study.trials = study.trials.assign(speed=speed)
        gap = reality_gap(noisy(study, default_rng(seed)), "speed+")
        wrong = [each.verdict != "not decided" for each in gap.controllers]
        wrong += [pair.verdict == "reverses" for pair in gap.pairs]
        alarms += any(wrong)
    assert alarms <= 33


def naive_worst(values: list[float]) -> float:
    """The mean of the lowest tenth: each value stands ten times in the list."""
    repeated = sorted(value for value in values for _ in range(10))
    return sum(repeated[: len(values)]) / len(values)


@pytest.mark.parametrize("n", [10, 17, 100, 101, 109])
def test_the_worst_tenth_is_that_of_a_slow_twin(n: int) -> None:
    values = default_rng(n).normal(size=n)
    assert worst_mean(values, 0.95).value == pytest.approx(naive_worst([*values]))
    highest = worst_mean(values, 0.95, low_is_worst=False)
    assert highest.value == pytest.approx(-naive_worst([*-values]))


def test_few_values_have_no_interval_of_the_worst_tenth() -> None:
    assert np.isnan(worst_mean(np.arange(9.0), 0.95).low)
    assert np.isnan(worst_mean(np.empty(0), 0.95).value)


@pytest.mark.slow
def test_intervals_of_the_worst_tenth_hold() -> None:
    """The worst tenth of a normal score is -1.755; of 400 samples of 200 some 93 %
    hold, and with 4 standard deviations at least 88 %.
    """
    hold = 0
    for seed in range(400):
        worst = worst_mean(default_rng(seed).normal(size=200), 0.95)
        hold += worst.low < -1.75498 < worst.high
    assert 0.88 < hold / 400 < 0.98


@pytest.mark.slow
def test_crossed_intervals_hold() -> None:
    """Means over 30 realities and 5 replicates, which both vary: 95 % and more."""
    hold = 0
    for seed in range(1000):
        rng = default_rng(seed)
        table = rng.normal(size=(30, 1)) + rng.normal(size=5) + rng.normal(size=(30, 5))
        rows, columns = table.mean(axis=1), table.mean(axis=0)
        interval = crossed_interval(table.mean(), rows, columns, 0.95)
        hold += interval.low < 0.0 < interval.high
    assert 0.94 < hold / 1000 < 0.99


def test_one_column_has_no_interval() -> None:
    table = default_rng(1).normal(size=(30, 1))
    assert np.isnan(crossed_estimate(worst_mean, table, 0.95).low)


@pytest.mark.slow
@pytest.mark.parametrize("deviation", [0.0, 1.0])
def test_intervals_hold_with_a_common_part_of_replicates(deviation: float) -> None:
    """Scores have an effect of the reality and one of the replicate, each with
    variance 1, and noise. Rows alone hold in 27 to 47 % of 300 tables. With replicates
    some 93 to 95 % hold: at least 89 %, 3 standard deviations of 93 % below.
    """
    true = np.sqrt(1.0 + deviation**2 / 5) * -1.75498
    worst_holds = 0
    rank_holds = 0
    for seed in range(300):
        rng = default_rng(seed)
        table = rng.normal(size=(200, 1)) + rng.normal(size=5)
        table = table + deviation * rng.normal(size=table.shape)
        worst = crossed_estimate(worst_mean, table, 0.95)
        rank = crossed_estimate(lost_fraction, table, 0.95)
        worst_holds += worst.low < true < worst.high
        rank_holds += rank.low < 0.5 < rank.high
    assert 267 <= worst_holds < 297
    assert 267 <= rank_holds < 297


def test_a_difference_of_intervals_adds_squares() -> None:
    first = Interval(1.0, 0.7, 1.4, 5)
    second = Interval(3.0, 2.6, 3.3, 9)
    difference = difference_interval(first, second)
    assert difference.value == 2.0
    assert difference.low == pytest.approx(2.0 - np.hypot(0.4, 0.4))
    assert difference.high == pytest.approx(2.0 + np.hypot(0.3, 0.3))


def test_indices_of_a_linear_function_are_the_parts_of_its_variance() -> None:
    """4 a + 2 b + c of uniform numbers, and d without an effect. The standard errors of
    200 draws are at most 0.06 (60 seeds).
    """
    drawn = pd.DataFrame(default_rng(3).random((200, 4)), columns=[*"abcd"])
    values = drawn.to_numpy() @ [4.0, 2.0, 1.0, 0.0]
    found = sobol_indices(drawn, values)
    expected = np.array([16.0, 4.0, 1.0, 0.0]) / 21.0
    for name in ("first", "total"):
        np.testing.assert_allclose(found.table[name], expected, atol=0.15)
    assert found.predicted > 0.99
    assert found.table["first_low"][0] < expected[0] < found.table["first_high"][0]


def test_indices_of_the_ishigami_function() -> None:
    """The standard errors of 1000 draws are at most 0.03 (60 seeds)."""
    drawn = pd.DataFrame(default_rng(5).random((1000, 3)), columns=[*SETTINGS])
    found = sobol_indices(drawn, ishigami(drawn))
    np.testing.assert_allclose(found.table["first"], FIRST, atol=0.09)
    np.testing.assert_allclose(found.table["total"], TOTAL, atol=0.09)
    assert found.predicted > 0.98
    assert found.degree >= 6


def test_a_monotone_change_of_a_parameter_changes_no_index() -> None:
    drawn = pd.DataFrame(default_rng(5).random((200, 2)), columns=[*"ab"])
    values = drawn["a"] * drawn["b"] + drawn["a"]
    found = sobol_indices(drawn, values.to_numpy())
    other = sobol_indices(np.exp(9.0 * drawn), values.to_numpy())
    pd.testing.assert_frame_equal(found.table, other.table)


def test_listed_values_enter_by_contrasts() -> None:
    """A map adds 0, 1 or 5: variance 14/3. A number adds up to 4: variance 4/3."""
    rng = default_rng(8)
    maps = rng.integers(3, size=600)
    drawn = pd.DataFrame({"map": np.array(["a", "b", "c"])[maps], "x": rng.random(600)})
    values = np.array([0.0, 1.0, 5.0])[maps] + 4.0 * drawn["x"].to_numpy()
    table = sobol_indices(drawn, values).table
    np.testing.assert_allclose(table["total"], [14 / 18, 4 / 18], atol=0.06)


def test_values_of_unequal_frequency_enter_by_orthonormal_contrasts() -> None:
    """A rare value adds 4, with variance 16 x 0.05 x 0.95; a number adds the
    variance 0.14. The parts are 0.844 and 0.156. Contrasts for equal frequencies give
    1.00.
    """
    rng = default_rng(9)
    rare = rng.permutation(np.arange(600) < 30)
    drawn = pd.DataFrame({"rare": rare.astype(float), "x": rng.random(600)})
    values = 4.0 * drawn["rare"] + np.sqrt(12 * 0.1404) * drawn["x"]
    table = sobol_indices(drawn, values.to_numpy()).table
    np.testing.assert_allclose(table["total"], [0.844, 0.156], atol=0.04)


def test_replicate_noise_is_taken_out_of_the_indices() -> None:
    """Half of the variance is noise. Means of 30 samples within 4 standard errors."""
    found = []
    for seed in range(30):
        rng = default_rng(seed)
        drawn = pd.DataFrame(rng.random((100, 2)), columns=[*"ab"])
        table = (drawn["a"] + 0.5 * drawn["b"]).to_numpy()[:, None]
        table = table + rng.normal(0.0, np.sqrt(4 * 1.25 / 12), (100, 4))
        noise = table.var(axis=1, ddof=1) / 4
        indices = sobol_indices(drawn, table.mean(axis=1), noise).table
        found.append(indices["first"].to_numpy())
    error = np.std(found, axis=0, ddof=1) / np.sqrt(30)
    assert (np.abs(np.mean(found, axis=0) - [0.8, 0.2]) < 4 * error).all()


def test_noise_alone_has_no_indices() -> None:
    rng = default_rng(2)
    drawn = pd.DataFrame(rng.random((100, 2)), columns=[*"ab"])
    table = rng.normal(size=(100, 4))
    found = sobol_indices(drawn, table.mean(axis=1), table.var(axis=1, ddof=1) / 4)
    assert found.degree == 0
    assert found.table["first"].isna().all()
    assert sobol_indices(drawn, np.ones(100)).degree == 0


def test_unknown_indices_have_the_true_reason() -> None:
    rng = default_rng(2)
    drawn = pd.DataFrame(rng.random((100, 2)), columns=[*"ab"])
    values = rng.normal(size=100)
    many = pd.DataFrame(rng.random((100, 40)))
    twice = pd.DataFrame({"a": drawn["a"], "b": drawn["a"]})
    noise = np.full(100, 1.0)
    cases = [
        (drawn[:29], values[:29], None, "indices need at least 30 realities"),
        (drawn, np.ones(100), None, "the score is equal in all realities"),
        (many, values, None, "too few realities for the number of imperfections"),
        (twice, values, None, "imperfections change together"),
        (drawn, values, noise, "the variance over realities is within replicate noise"),
    ]
    for parameters, scores, error, reason in cases:
        indices = sobol_indices(parameters, scores, error)
        assert indices.reason.startswith(reason)
        assert indices.table["total"].isna().all()
    assert sobol_indices(drawn, drawn["a"].to_numpy()).reason == ""


def _parts_of(gap: RealityGap) -> Axes:
    """The right panel of the figure."""
    return draw_gap(gap).axes[1]


def test_the_report_has_the_reason_of_each_controller() -> None:
    """The score of weight 2 is 0.4 in all realities."""
    gap = reality_gap(made_up(crossing), "speed+")
    caption = gap_report(gap).parts[-1].caption
    assert "separation weight = 2: the score is equal in all realities" in caption
    assert "separation weight = 1:" not in caption
    words = [(text.get_position()[1], text.get_text()) for text in _parts_of(gap).texts]
    assert words == [(1, "not known")]
    few = gap_report(reality_gap(made_up(crossing, draws=20), "speed+"))
    caption = few.parts[-1].caption
    assert "-: indices need at least 30 realities with a score" in caption
    assert few.facts["controllers"][0]["reason"]


SPEC = """\
study: robots
model: nguyen2024
preset: as_run
fixed: {n: 10, steps: 20, packet_loss: 0.1}
realities: {position_noise: {loguniform: [1, 10]}, packet_loss: {uniform: [0, 1]},
  radio_range: {choice: [20, .inf]}, draws: 30}
sweep: {separation_weight: [0.5, 2]}
replicates: 2
seed: 1
record: {metrics: [polarization, speed]}
"""


def test_a_stored_study_has_a_gap(tmp_path: Path) -> None:
    study = launched(SPEC, tmp_path / "results")
    assert study.about.sections["realities"] == {
        "design": {"position_noise": 0.0, "packet_loss": 0.1, "radio_range": np.inf}
    }
    gap = reality_gap(study)
    assert (gap.metric, gap.draws) == ("polarization", 30)
    assert [*gap.scores.imperfections] == [
        "position_noise",
        "packet_loss",
        "radio_range",
    ]
    facts = json.loads(gap_report(gap).to_json())
    assert len(facts["controllers"]) == 2
    assert len(facts["pairs"]) == 1
    run = command(tmp_path, "gap", "robots", "--metric", "speed-", "--csv")
    rows = run.stdout.splitlines()
    assert len(rows) == 1 + 2 * (4 + 2 * 3) + 3
    assert rows[0].startswith("quantity,controller,other,imperfection,value,low,high")
    for form in ([], ["--latex"]):
        assert "worst tenth" in command(tmp_path, "gap", "robots", *form).stdout


def test_repeated_draws_are_reported() -> None:
    """60 draws of 5 x 4 values, of which one is the design world."""
    discrete = "packet_loss: {choice: [0, 0.1, 0.2, 0.3, 0.4]}"
    discrete += ", position_noise: {choice: [0, 1, 2, 3]}"
    gap = reality_gap(made_up(weights_alone, discrete, draws=60), "speed")
    assert gap.draws + gap.repeated == 60
    assert gap.repeated >= 60 - 19
    assert f"{gap.repeated} draws left out" in gap_report(gap).parts[0].caption
    assert reality_gap(made_up(weights_alone), "speed").repeated == 0


def test_more_draws_run_only_the_new_realities(tmp_path: Path) -> None:
    study = launched(SPEC, tmp_path)
    before = scores_of(study, "speed")
    more = SPEC.replace("draws: 30", "draws: 40")
    progress = relaunch(more, tmp_path)
    assert (progress.stored, progress.trials) == (31 * 2 * 2, 41 * 2 * 2)
    after = scores_of(launched(more, tmp_path), "speed")
    np.testing.assert_array_equal(after.drawn[:, :30], before.drawn)
    np.testing.assert_array_equal(after.design, before.design)


def test_a_study_without_realities_has_no_gap(tmp_path: Path) -> None:
    others = [line for line in SPEC.splitlines() if "realit" not in line]
    spec = "\n".join(line for line in others if "radio" not in line)
    study = launched(spec, tmp_path)
    with pytest.raises(ChoiceError, match='the spec has no "realities"'):
        reality_gap(study)
    with pytest.raises(ChoiceError, match="confidence must be between 0 and 1"):
        reality_gap(study, confidence=95)
