"""Calibration: posteriors with known answers, resumed launches, and bad input."""

import json
import math
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML
from scipy.stats import binomtest, kstest, norm, truncnorm

from sweep.campaigns.launching import check_launches, launch
from sweep.campaigns.plan import plan_of
from sweep.design.jobs import Job
from sweep.errors import ChoiceError, SpecError, StoreError, UserError
from sweep.figures import Choices, posterior_figure
from sweep.loaded import LoadedStudy
from sweep.methods.calibration import figure
from sweep.methods.calibration.analysis import Posterior, quantiles, uniformity
from sweep.methods.calibration.distances import Distance, spread_of
from sweep.methods.calibration.figure import KIND
from sweep.methods.calibration.method import status, unfinished
from sweep.methods.calibration.proposals import Population, ProposalKernel
from sweep.methods.calibration.report import posterior_report
from sweep.methods.calibration.rule import Summary
from sweep.methods.calibration.strategy import ABOUT
from sweep.spec.profiles import ProfilePoint
from sweep.spec.schema import json_schema
from sweep.spec.study import parse_spec
from sweep.trial.result import ProfileValues, Result, failed
from sweep.workers.executors import Serial
from tests.methods.measured_calibration import (
    Simulate,
    heads,
    mean_of_four,
    measured,
)
from tests.methods.measured_calibration import ridge as ridge_of_two
from tests.plotted import study as study_of
from tests.searches import done, replace_trials

DATA = """
study: data
model: nguyen2024
preset: as_run
fixed: {n: 5, steps: 1, separation_weight: 1.5}
replicates: 4
record: {metrics: [speed], every: 1}
"""
FIT = """
study: fit
model: nguyen2024
preset: as_run
fixed: {n: 5, steps: 1}
sweep:
  prior: {sample: random, points: 400, separation_weight: {uniform: [0, 3]}}
calibrate: {to: data, summaries: [speed], population: 200, generations: 4}
replicates: 4
seed: 5
record: {metrics: [speed], every: 1}
"""
SMALL = FIT.replace("points: 400", "points: 100").replace(
    "population: 200, generations: 4", "population: 50, generations: 2"
)
"""The same where no precision counts: 100 + 2 * 50 simulations of 4 trials."""
SECOND = "[0, 3]}, cohesion_weight: {uniform: [0, 3]}"
TWO = FIT.replace("[0, 3]}", SECOND)
SMALL_TWO = SMALL.replace("[0, 3]}", SECOND)
PROFILED = "every: 1, profiles: [{name: pair_distribution, to: 3}]"
OF_PROFILE = SMALL.replace(
    "[speed]", "{pair_distribution: {at: [1.5], statistics: mean}}", 1
).replace("every: 1", PROFILED)
SURE = 4.0
"""Standard errors by which a mean may be away: false alarms of 1 in 16,000."""
VALIDATOR = Draft7Validator(json_schema())


def normal(job: Job) -> Result:
    """A trial with a speed of normal noise around the parameter."""
    rng = np.random.default_rng([int(job.point, 16), job.replicate])
    mean = float(job.settings["separation_weight"])
    return done(job, {"speed": mean + rng.normal()})


def scarcely_random(job: Job) -> Result:
    """A trial with nearly the parameter as its speed."""
    result = normal(job)
    mean = float(job.settings["separation_weight"])
    return done(job, {"speed": mean + 0.1 * (result.last["speed"] - mean)})


def profiled(job: Job) -> Result:
    """A trial whose profile has the speed of `normal` in the middle."""
    result = normal(job)
    speed = result.last["speed"]
    at = np.array([0.5, 1.5, 2.5])
    values = np.array([speed - 1.0, speed, speed + 1.0])
    profile = ProfileValues(at, values)
    return replace(result, profiles={"pair_distribution": profile})


def ridge(job: Job) -> Result:
    """A trial of which the data tell only the sum of two parameters."""
    rng = np.random.default_rng([int(job.point, 16), job.replicate])
    names = ("separation_weight", "cohesion_weight")
    mean = sum(float(job.settings[name]) for name in names)
    return done(job, {"speed": mean + 0.2 * rng.normal()})


def posterior(
    results: Path,
    monkeypatch: pytest.MonkeyPatch,
    spec: str = FIT,
    trial: Callable[[Job], Result] = normal,
) -> Posterior:
    """The posterior after a launch of the data and of a calibration."""
    replace_trials(monkeypatch, trial)
    for text in (DATA, spec):
        launch(parse_spec(text), results, Serial())
    return LoadedStudy("fit", results).posterior()


def test_the_posterior_of_a_normal_mean_is_the_exact_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = posterior(tmp_path, monkeypatch)
    (row,) = found.parameters.to_dict("records")
    mean = LoadedStudy("data", tmp_path).trials["speed"].mean()
    # The distance widens the error of the mean of 4 trials by a uniform tolerance.
    spread = found.predictive["spread"][0]
    error = math.hypot(0.5, found.tolerance * spread / math.sqrt(3.0))
    exact = truncnorm(-mean / error, (3.0 - mean) / error, mean, error)
    allowance = SURE * exact.std() / math.sqrt(found.effective)
    assert row["mean"] == pytest.approx(exact.mean(), abs=allowance)
    # The standard error of a standard deviation of n normal values is sd / sqrt(2 n).
    assert row["sd"] == pytest.approx(exact.std(), abs=allowance / math.sqrt(2.0))
    assert found.finished
    assert found.effective > 0.8 * len(found.draws)
    assert found.draws["weight"].sum() == pytest.approx(1.0, rel=1e-12)
    tolerances = found.generations["tolerance"].to_numpy()
    assert (np.diff(tolerances) < 0.0).all()
    assert found.simulations == 400 + 4 * 200
    assert found.fit > 0.05


def test_a_ridge_stays_a_ridge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = posterior(tmp_path, monkeypatch, TWO, ridge)
    first = found.draws["separation_weight"].to_numpy()
    second = found.draws["cohesion_weight"].to_numpy()
    weights = found.draws["weight"].to_numpy()
    (data,) = found.predictive["data"]
    total = first + second
    middle = (weights * total).sum()
    spread = math.sqrt((weights * (total - middle) ** 2).sum())
    assert middle == pytest.approx(data, abs=SURE * spread / math.sqrt(found.effective))
    assert spread < 0.3
    # Along the ridge the prior stays: both parameters are uniform up to the sum.
    end = min(data, 3.0)
    start = data - end
    length = end - start
    among = math.sqrt(length**2 / 12.0 / found.effective)
    assert (weights * first).sum() == pytest.approx(data / 2, abs=SURE * among)
    assert np.corrcoef(first, second)[0, 1] < -0.8


def test_probabilities_of_listed_values_are_those_of_bayes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def coin(job: Job) -> Result:
        rng = np.random.default_rng([int(job.point, 16), job.replicate])
        chance = {"sequential": 0.3, "synchronous": 0.7}[str(job.settings["update"])]
        heads = job.settings["separation_weight"] == 1.5 or rng.random() < chance
        return done(job, {"speed": float(heads)})

    spec = FIT.replace(
        "separation_weight: {uniform: [0, 3]}",
        "update: {choice: [sequential, synchronous]}",
    ).replace("generations: 4", "generations: 2")
    found = posterior(tmp_path, monkeypatch, spec, coin)
    assert found.parameters.empty
    # The data are 4 heads, which only simulations with 4 heads equal. The spec keeps
    # 200 simulations, more than have 4 heads, so others within the tolerance count.
    heads = round(4 * (1.0 - found.tolerance * found.predictive["spread"][0]))
    chances = {"sequential": 0.3, "synchronous": 0.7}
    likely = {
        name: sum(
            math.comb(4, k) * chance**k * (1.0 - chance) ** (4 - k)
            for k in range(heads, 5)
        )
        for name, chance in chances.items()
    }
    rows = found.choices.set_index("value")["posterior"]
    exact = likely["synchronous"] / sum(likely.values())
    error = math.sqrt(exact * (1.0 - exact) / found.effective)
    assert rows["synchronous"] == pytest.approx(exact, abs=SURE * error)
    assert rows.sum() == pytest.approx(1.0)
    study = LoadedStudy("fit", tmp_path)
    # Two points have all simulations, each with random numbers of its own.
    assert study.plan["point"].value_counts().to_pylist()[0]["counts"] > 200
    assert len(set(study.plan["trial_id"].to_pylist())) == study.plan.num_rows
    with pytest.raises(
        ChoiceError, match="no parameter of the calibration has numbers"
    ):
        posterior_figure(study)


@pytest.mark.parametrize("after", [0, 500, 799])
def test_an_interrupted_calibration_ends_as_an_undisturbed_one(
    after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = posterior(tmp_path / "whole", monkeypatch, SMALL)
    count = 0

    def interrupted(job: Job) -> Result:
        nonlocal count
        if job.settings["separation_weight"] != 1.5:
            count += 1
            if count == after + 1:
                raise KeyboardInterrupt
        return normal(job)

    with pytest.raises(KeyboardInterrupt):
        posterior(tmp_path / "cut", monkeypatch, SMALL, interrupted)
    again = posterior(tmp_path / "cut", monkeypatch, SMALL, interrupted)
    assert again.draws.equals(whole.draws)
    plans = [
        LoadedStudy("fit", tmp_path / name).store.read_plan()["trial_id"]
        for name in ("whole", "cut")
    ]
    assert plans[0].equals(plans[1])


@pytest.mark.parametrize("after", [0, 500])
def test_a_point_of_a_profile_tells_as_much_as_a_metric_with_the_same_values(
    after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the values come from the store, after an interruption."""
    of_metric = posterior(tmp_path / "metric", monkeypatch, SMALL)
    monkeypatch.setattr(f"{__name__}.DATA", DATA.replace("every: 1", PROFILED))
    count = 0

    def interrupted(job: Job) -> Result:
        nonlocal count
        count += 1
        if after and count == after:
            raise KeyboardInterrupt
        return profiled(job)

    with pytest.raises(KeyboardInterrupt) if after else nullcontext():
        posterior(tmp_path, monkeypatch, OF_PROFILE, interrupted)
    of_profile = posterior(tmp_path, monkeypatch, OF_PROFILE, interrupted)
    words = "mean of pair_distribution at 1.5"
    assert of_profile.draws.rename(columns={words: "mean of speed"}).equals(
        of_metric.draws
    )
    assert of_profile.predictive["summary"].tolist() == [words]


def test_more_generations_keep_what_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    posterior(tmp_path, monkeypatch, SMALL)
    jobs = replace_trials(monkeypatch, normal)
    spec = SMALL.replace("generations: 2", "generations: 3")
    progress = launch(parse_spec(spec), tmp_path, Serial())
    assert len(jobs) == 50 * 4
    assert progress.note.startswith("generation 3: tolerance ")
    assert LoadedStudy("fit", tmp_path).posterior().simulations == 100 + 3 * 50


def test_what_require_leaves_out_is_never_proposed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = f"{TWO}require: [separation_weight > cohesion_weight]\n".replace(
        "400", "600"
    )
    found = posterior(tmp_path, monkeypatch, spec, ridge)
    trials = LoadedStudy("fit", tmp_path).trials
    assert (trials["separation_weight"] > trials["cohesion_weight"]).all()
    # Half of the ridge is left, with the prior along this half.
    (data,) = found.predictive["data"]
    end = min(data, 3.0)
    middle = (data / 2 + end) / 2
    weights = found.draws["weight"].to_numpy()
    mean = (weights * found.draws["separation_weight"]).sum()
    error = (end - data / 2) / math.sqrt(12.0 * found.effective)
    assert mean == pytest.approx(middle, abs=SURE * error)


def test_weights_hold_where_require_leaves_little_of_the_prior() -> None:
    """The mean of 40 runs, near a corner of the tenth that a spec allows."""
    rng = np.random.default_rng(11)
    means = []
    for _ in range(40):
        draws = rng.random((3000, 1))
        draws = draws[draws[:, 0] < 0.1]
        population = Population(150)
        distances = np.abs(draws[:, 0] + 0.02 * rng.standard_normal(len(draws)))
        population.add(draws, distances, allowed=len(draws) / 3000)
        for _ in range(2):
            kernel = population.kernel()
            draws, allowed = kernel.draw(150, rng, lambda some: some[:, 0] < 0.1)
            noise = 0.02 * rng.standard_normal(len(draws))
            population.add(draws, np.abs(draws[:, 0] + noise), kernel, allowed)
        nearest = population.draws[population.nearest, 0]
        grid = np.linspace(0.0, 0.1, 2001)
        ends = (population.tolerance - grid, -population.tolerance - grid)
        likely = norm.cdf(ends[0] / 0.02) - norm.cdf(ends[1] / 0.02)
        exact = (grid * likely).sum() / likely.sum()
        means.append((population.weights * nearest).sum() - exact)
    error = np.std(means, ddof=1) / math.sqrt(len(means))
    assert np.mean(means) == pytest.approx(0.0, abs=SURE * error)


def test_equal_distances_are_kept_whatever_their_age() -> None:
    population = Population(2)
    population.add(np.array([[0.1], [0.2], [0.3]]), np.array([1.0, 1.0, 2.0]))
    kernel = population.kernel()
    population.add(np.array([[0.4], [0.5]]), np.array([1.0, 3.0]), kernel, 0.9)
    assert population.nearest.tolist() == [0, 1, 3]
    assert population.generations[-1].accepted == 0.5
    assert population.tolerance == 1.0


def test_parameters_that_add_columns_only_at_some_points(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A torus has a column of minimum images, which a round without one lacks."""

    def bordered(job: Job) -> Result:
        levels = {"open": 1.0, "bounded": 5.0, "torus": 9.0}
        level = levels[str(job.settings["borders"])]
        return done(job, {"speed": level + normal(job).last["speed"]})

    spec = FIT.replace("uniform: [0, 3]", "uniform: [0, 0.5]").replace(
        "0.5]}}", "0.5]}, borders: {choice: [open, bounded, torus]}}"
    )
    data = DATA.replace("1.5}", "0.2, borders: open}")
    replace_trials(monkeypatch, bordered)
    for text in (data, spec.replace("population: 200", "population: 50")):
        launch(parse_spec(text), tmp_path, Serial())
    found = LoadedStudy("fit", tmp_path).posterior()
    chances = found.choices.set_index("value")["posterior"]
    assert chances["open"] > 0.99
    assert found.choices["prior"].sum() == pytest.approx(1.0)


def test_a_generation_that_still_runs_does_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = posterior(tmp_path / "whole", monkeypatch, SMALL)
    count = 0

    def interrupted(job: Job) -> Result:
        nonlocal count
        count += job.settings["separation_weight"] != 1.5
        if count == 100 * 4 + 50 * 4 + 7:
            raise KeyboardInterrupt
        return normal(job)

    with pytest.raises(KeyboardInterrupt):
        posterior(tmp_path / "cut", monkeypatch, SMALL, interrupted)
    study = LoadedStudy("fit", tmp_path / "cut")
    found = study.posterior()
    assert found.generations.equals(whole.generations[:2])
    assert not found.finished
    assert found.missing > 0
    assert unfinished(study) == "generations of fit follow"


def test_a_calibration_ends_where_hardly_a_proposal_is_accepted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = FIT.replace("generations: 4", "generations: 9, acceptance: 0.5")
    found = posterior(tmp_path, monkeypatch, spec)
    assert len(found.generations) < 9
    assert found.generations["accepted"].iloc[-1] < 0.5
    assert found.finished


def test_trials_that_fail_are_no_simulations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fragile(job: Job) -> Result:
        if float(job.settings["separation_weight"]) > 2.0:
            return failed(job, 0.0, "broken")
        return normal(job)

    spec = f"{SMALL}on_error: record\n"
    found = posterior(tmp_path, monkeypatch, spec, fragile)
    assert found.draws["separation_weight"].max() <= 2.0


def test_without_a_complete_simulation_nothing_is_estimated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(job: Job) -> Result:
        if job.settings["separation_weight"] == 1.5:
            return normal(job)
        return failed(job, 0.0, "broken")

    with pytest.raises(StoreError, match="no simulation has all summaries"):
        posterior(tmp_path, monkeypatch, f"{SMALL}on_error: record\n", broken)
    study = LoadedStudy("fit", tmp_path)
    assert "no trials have values of speed" in status(study)["calibration"]


def test_misfit_is_said_before_any_interval(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def beyond(job: Job) -> Result:
        far = 40.0 if job.settings["separation_weight"] == 1.5 else 0.0
        return done(job, {"speed": normal(job).last["speed"] + far})

    found = posterior(tmp_path, monkeypatch, SMALL, beyond)
    assert found.fit < 0.01
    first, second, *_ = posterior_report(found).parts
    assert isinstance(first, str)
    assert first.startswith("misfit: only <1 % of data sets from the prior")
    assert isinstance(second, str)
    assert "is outside of all simulations of the prior" in second


CHECKED = SMALL.replace("generations: 2", "generations: 2, checks: 40")


def test_ranks_of_known_parameters_are_uniform(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = posterior(tmp_path, monkeypatch, CHECKED)
    (row,) = found.checks.to_dict("records")
    assert row["data_sets"] == len(found.ranks) == 40
    # The seed is fixed; false alarms of 1 % would show with another.
    assert row["p"] > 0.01
    assert kstest(found.ranks["separation_weight"], "uniform").pvalue > 0.01
    assert row["coverage_95_low"] <= 0.95 <= row["coverage_95_high"]
    report = posterior_report(found)
    assert report.facts["checked"]
    assert report.facts["checks"][0]["data_sets"] == 40


@pytest.mark.parametrize(
    ("simulate", "parameters"), [(mean_of_four, 1), (ridge_of_two, 2), (heads, 1)]
)
def test_intervals_hold_the_truth_as_often_as_they_say(
    simulate: Simulate, parameters: int
) -> None:
    """With a chance of a false alarm of 0.1 % each, for another seed."""
    _, _, inside, _ = measured(simulate, parameters, 5, 100)
    assert binomtest(round(100 * inside), 100, 0.95).pvalue > 0.001


def test_ranks_of_a_posterior_that_is_too_narrow_are_not_uniform() -> None:
    rng = np.random.default_rng(1)
    assert uniformity(rng.random(200)) > 0.01
    assert uniformity(rng.beta(0.3, 0.3, 200)) < 0.001
    assert math.isnan(uniformity(rng.random(5)))


def test_a_report_says_what_was_not_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = posterior(tmp_path, monkeypatch, SMALL)
    report = posterior_report(found)
    title = next(part for part in report.parts if not isinstance(part, str)).title
    assert title == "fit: posterior given data (4 trials), not checked"
    facts = json.loads(report.to_json())
    assert facts["checked"] is False
    assert facts["calibrate"]["to"] == "data"
    assert len(facts["draws"]) == len(report.rows) == 50
    study = LoadedStudy("fit", tmp_path)
    assert status(study)["calibration"].startswith("generation 2, tolerance ")
    assert unfinished(study) == ""
    assert unfinished(LoadedStudy("data", tmp_path)) == ""
    with pytest.raises(ChoiceError, match='the spec has no "calibrate"'):
        LoadedStudy("data", tmp_path).posterior()
    with pytest.raises(ChoiceError, match="cannot be restricted by where"):
        study.where("separation_weight > 1").posterior()


@pytest.mark.parametrize(
    ("prior", "end"),
    [("[2.5, 5.5]", "first"), ("[0, 0.5]", "last"), ("[0, 3]", "")],
)
def test_a_posterior_that_ends_where_the_prior_ends_is_said(
    prior: str, end: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = SMALL.replace("[0, 3]", prior)
    outcome = posterior(tmp_path, monkeypatch, spec, scarcely_random)
    (row,) = outcome.parameters.to_dict("records")
    parts = posterior_report(outcome).parts
    caption = next(part for part in parts if not isinstance(part, str)).caption
    ends = {name for name in ("first", "last") if row[name] > 0.2}
    assert ends == ({end} if end else set())
    assert ("5 % of the prior: values beyond" in caption) == bool(end)
    assert f"in the {end}" in caption or not end


def test_summaries_learnt_by_regression_find_the_parameter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = FIT.replace(
        "summaries: [speed]", "learnt: true, summaries: {speed: [mean, sd]}"
    )
    found = posterior(tmp_path, monkeypatch, spec)
    (row,) = found.parameters.to_dict("records")
    mean = LoadedStudy("data", tmp_path).trials["speed"].mean()
    # The error of the mean of 4 trials is 0.5, whatever the standard deviation is.
    assert row["mean"] == pytest.approx(mean, abs=0.3)
    assert row["sd"] == pytest.approx(0.5, abs=0.15)


def test_the_plan_says_the_most_trials() -> None:
    plan = plan_of(parse_spec(CHECKED), 1)
    most = (40 + 41 * (100 + 2 * 50)) * 4
    assert plan.trials == most
    assert (
        f"400 to {most:,} (4 to 4 per point; up to 2 generations of 50 simulations,"
        " also for 40 synthetic data sets)"
    ) in plan.as_text()


def test_a_spec_with_the_section_is_valid() -> None:
    study = parse_spec(TWO)
    rule = study.sections["calibrate"]
    assert [*rule.priors] == ["separation_weight", "cohesion_weight"]
    assert rule.summaries == (Summary("speed", "mean"),)
    assert study.streams.start == study.streams.world == "independent"
    read = YAML(typ="safe", pure=True).load(CHECKED)
    VALIDATOR.validate(read)
    single = FIT.replace(
        "prior: {sample: random, points: 400, separation_weight: {uniform: [0, 3]}}",
        "separation_weight: {normal: [1, 1], points: 400}",
    )
    assert [*parse_spec(single).sections["calibrate"].priors] == ["separation_weight"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("to: data, ", "", 'missing key "to" in "calibrate"'),
        (
            "sweep:\n  prior: {sample: random, points: 400, separation_weight:"
            " {uniform: [0, 3]}}\n",
            "",
            "exactly one axis, whose distributions are the prior; it has 0",
        ),
        (
            "sweep:\n  prior: {sample: random, points: 400, separation_weight:"
            " {uniform: [0, 3]}}\n",
            "sizes: {n: [20, 40]}\n",
            'the only axis of the spec is "sizes", of another section',
        ),
        ("[speed], pop", "[sped], pop", 'unknown recorded metric "sped"; did you mean'),
        ("[speed], pop", "{speed: median}, pop", "statistic"),
        ("[speed], pop", "{speed: 1.5}, pop", "a probability above 0 and below 1"),
        ("[speed], pop", "{speed: [mean, mean]}, pop", "a statistic twice"),
        ("[speed], pop", "[pair_distribution], pop", "is a profile: write"),
        ("[speed], pop", "{pair_distribution: mean}, pop", "positions of a profile"),
        ("[speed], pop", "{speed: {at: [1]}}, pop", "must be mean, sd, or a prob"),
        ("[speed], pop", "{pair_distribution: {at: [1]}}, pop", "is not recorded"),
        ("[speed], pop", "{pair_distribution: {att: [1]}}, pop", 'did you mean "at"'),
        ("[speed], pop", "{pair_distribution: {at: [0]}}, pop", "a number above 0"),
        ("[speed], pop", "{directional_delay: {at: [1]}}, pop", "are individuals"),
        ("population: 200", "population: 2", "an integer from 50"),
        (
            "points: 400",
            "points: 100",
            "at least as many points as the 200 simulations",
        ),
        ("sample: random", "sample: saltelli", "is no prior"),
        ("seed: 5", "seed: 5\nstreams: {start: common}", "must be independent"),
        ("replicates: 4", "seeds: [1, 2]", "needs"),
        (
            "calibrate: {to",
            "calibrate: {learn: true, to",
            'unknown key "learn"; did you mean "learnt"?',
        ),
        (
            "prior: {sample: random, points: 400, separation_weight: {uniform: [0, 3]}",
            "separation_weight: {values: [1, 2]",
            "is no prior",
        ),
        (
            "\ncalibrate",
            "\n  cohesion_weight: [1, 2]\ncalibrate",
            "exactly one axis, whose distributions are the prior; it has 2",
        ),
    ],
)
def test_a_mistake_is_said_with_its_line(old: str, new: str, message: str) -> None:
    assert old in FIT
    with pytest.raises(SpecError) as raised:
        parse_spec(FIT.replace(old, new, 1))
    assert message in str(raised.value)
    assert str(raised.value).startswith("spec.yaml:")


def test_a_position_beyond_the_axis_is_a_mistake() -> None:
    # 30 bins of 0.1, with the values at their centres.
    for at in (0.04, 2.96):
        with pytest.raises(SpecError, match=r"whose values are from 0\.05 to 2\.95"):
            parse_spec(OF_PROFILE.replace("at: [1.5]", f"at: [1.5, {at}]"))
    read = YAML(typ="safe", pure=True).load(OF_PROFILE)
    VALIDATOR.validate(read)
    read["calibrate"]["summaries"]["pair_distribution"]["at"] = []
    assert not VALIDATOR.is_valid(read)


def test_a_derived_metric_with_the_name_of_a_profile_is_a_metric() -> None:
    derived = "derive: {pair_distribution: 1 - polarization}, metrics: [speed]"
    spec = FIT.replace("metrics: [speed]", derived)
    for summaries in ("[pair_distribution]", "{pair_distribution: mean}"):
        study = parse_spec(spec.replace("[speed], pop", f"{summaries}, pop"))
        rule = study.sections["calibrate"]
        assert rule.summaries == (Summary("pair_distribution", "mean"),)


def test_all_mistakes_are_reported_together() -> None:
    spec = FIT.replace("[speed], pop", "[sped], pop").replace("200", "500")
    with pytest.raises(SpecError) as raised:
        parse_spec(spec)
    assert "spec.yaml:7: the prior needs at least" in str(raised.value)
    assert 'spec.yaml:8: unknown recorded metric "sped"' in str(raised.value)


def test_summaries_that_need_trials_ask_for_them() -> None:
    spec = FIT.replace("[speed], pop", "{speed: sd}, pop").replace(
        "replicates: 4", "replicates: 1"
    )
    with pytest.raises(SpecError, match="the sd of speed needs at least 2 trials"):
        parse_spec(spec)


def test_data_that_cannot_be_used_are_refused_before_any_trial(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = replace_trials(monkeypatch, normal)
    with pytest.raises(SpecError, match=r"the data cannot be read: .*data"):
        launch(parse_spec(FIT), tmp_path, Serial())
    launch(parse_spec(DATA.replace("[speed]", "[flock_radius]")), tmp_path, Serial())
    count = len(jobs)
    with pytest.raises(SpecError, match="data lacks speed; recorded: flock_radius"):
        launch(parse_spec(FIT), tmp_path, Serial())
    launch(
        parse_spec(DATA.replace("replicates: 4", "replicates: 1")), tmp_path, Serial()
    )
    spec = FIT.replace("[speed], pop", "{speed: sd}, pop")
    with pytest.raises(SpecError, match="the 1 trial of data have no sd of speed"):
        launch(parse_spec(spec), tmp_path, Serial())
    assert len(jobs) == count + 1


def test_data_without_a_value_of_a_profile_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_trials(monkeypatch, profiled)
    study = parse_spec(OF_PROFILE)
    launch(parse_spec(DATA), tmp_path, Serial())
    with pytest.raises(SpecError, match="data lacks pair_distribution; recorded: "):
        launch(study, tmp_path, Serial())
    again = parse_spec(DATA.replace("every: 1", PROFILED))
    launch(again, tmp_path, Serial())
    replace_trials(monkeypatch, normal)
    apart = DATA.replace("study: data", "study: apart").replace("every: 1", PROFILED)
    launch(parse_spec(apart), tmp_path, Serial())
    without = parse_spec(OF_PROFILE.replace("to: data", "to: apart"))
    with pytest.raises(SpecError, match="no trial of apart has pair_distribution"):
        launch(without, tmp_path, Serial())
    beyond = parse_spec(OF_PROFILE.replace("at: [1.5]", "at: [0.25]"))
    with pytest.raises(SpecError, match=r"from 0\.5 to 2\.5 in data, so .* at 0\.25"):
        launch(beyond, tmp_path, Serial())
    other = OF_PROFILE.replace("nguyen2024", "vicsek1995").replace(
        "separation_weight: {uniform: [0, 3]}", "noise: {uniform: [0, 3]}"
    )
    other = other.replace("to: 3", "to: 2")
    with pytest.raises(SpecError, match="the axis of pair_distribution cannot be comp"):
        launch(parse_spec(other), tmp_path, Serial())


def test_data_of_several_points_or_of_the_study_itself_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_trials(monkeypatch, normal)
    with pytest.raises(SpecError, match="not the study itself"):
        launch(parse_spec(FIT.replace("to: data", "to: fit")), tmp_path, Serial())
    several = DATA.replace("n: 5, ", "") + "sweep: {n: [4, 5]}\n"
    launch(parse_spec(several), tmp_path, Serial())
    with pytest.raises(SpecError, match=r"data has 2 points, .* data:parameter=value"):
        launch(parse_spec(FIT), tmp_path, Serial())
    spec = FIT.replace("to: data", 'to: "data:n=4"')
    launch(parse_spec(spec), tmp_path, Serial())
    assert LoadedStudy("fit", tmp_path).posterior().data_trials == 4


def test_a_derived_metric_is_a_summary_with_its_unit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def doubled(job: Job) -> Result:
        speed = normal(job).last["speed"]
        return done(job, {"speed": speed, "doubled": 2.0 * speed})

    derived = "metrics: [speed], derive: {doubled: 2 * speed}"
    monkeypatch.setattr(f"{__name__}.DATA", DATA.replace("metrics: [speed]", derived))
    spec = SMALL.replace("metrics: [speed]", derived).replace("[speed]", "[doubled]", 1)
    outcome = posterior(tmp_path, monkeypatch, spec, doubled)
    assert outcome.predictive["summary"].tolist() == ["mean of doubled"]
    assert LoadedStudy("data", tmp_path).units["doubled"] == "px/step"


def test_data_in_another_unit_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace_trials(monkeypatch, normal)
    launch(parse_spec(DATA), tmp_path, Serial())
    spec = FIT.replace("nguyen2024", "vicsek1995").replace(
        "separation_weight: {uniform: [0, 3]}", "noise: {uniform: [0, 3]}"
    )
    with pytest.raises(SpecError, match="the unit is px/step in data and r/step here"):
        launch(parse_spec(spec), tmp_path, Serial())


def test_a_prior_of_which_require_leaves_too_little_is_refused() -> None:
    spec = f"{TWO}require: [separation_weight > 10 * cohesion_weight]\n"
    with pytest.raises(SpecError, match=r"allows \d+ of 400 draws from the prior"):
        check_launches([parse_spec(spec)])


@pytest.fixture
def calibrated(monkeypatch: pytest.MonkeyPatch) -> Callable[[pa.Table], LoadedStudy]:
    """A small calibration of real trials, with other requests in its plan."""
    stored = study_of("calibrated")

    def changed(requests: pa.Table) -> LoadedStudy:
        study = LoadedStudy(stored.name, stored.store.results)
        monkeypatch.setitem(vars(study), "asked", requests)
        return study

    return changed


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("rule", "replicates"), 0),
        (("rule", "replicates"), 4),
        (("rule", "population"), -1),
        (("rule", "priors"), {}),
        (("rule", "priors"), {"separation_weight": {"cauchy": [0, 1]}}),
        (("rule", "priors"), {"cohesion_weight": {"uniform": [0, 1]}}),
        (("rule", "summaries"), []),
        (("rule", "summaries"), [["speed", "var"]]),
        (("rule", "summaries"), [["speed", None]]),
        (("rule", "summaries"), [["speed"]]),
        (("rule", "summaries"), [[["speed"], "mean"]]),
        (("rule", "summaries"), [["status", "mean"]]),
        (("rule", "summaries"), [["speed", "mean", 1.0]]),
        (("rule", "summaries"), [["pair_distribution", "mean", "0.5"]]),
        (("rule", "summaries"), [["pair_distribution", "mean", True]]),
        (("rule", "summaries"), [["pair_distribution", "mean", -1]]),
        (("rule", "summaries"), [["pair_distribution", 10**400, 1]]),
        (("rule", "summaries"), [["pair_distribution", "mean"]]),
        (("data",), [1.0, 2.0]),
        (("allowed",), []),
        (("allowed",), [[0.0]]),
        (("finished",), 1),
    ],
)
def test_a_damaged_plan_is_refused(
    path: tuple[str, ...],
    value: object,
    calibrated: Callable[[pa.Table], LoadedStudy],
) -> None:
    requests = study_of("calibrated").asked
    assert requests is not None
    description = json.loads(requests.schema.metadata[ABOUT])
    inner = description
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    study = calibrated(
        requests.replace_schema_metadata({ABOUT: json.dumps(description)})
    )
    with pytest.raises(UserError, match=r"plan\.parquet"):
        study.posterior()


@pytest.mark.parametrize(
    "column", ["data_set", "generation", "draw of separation_weight", "trial_id"]
)
def test_requests_of_other_kinds_are_refused(
    column: str, calibrated: Callable[[pa.Table], LoadedStudy]
) -> None:
    requests = study_of("calibrated").asked
    assert requests is not None
    place = requests.column_names.index(column)
    kind = requests.schema.field(column).type
    for values in (
        pa.nulls(len(requests), kind),
        pa.array([7.5] * len(requests)),
        pa.array(["x"] * len(requests)),
    ):
        study = calibrated(requests.set_column(place, column, values))
        with pytest.raises(StoreError, match="the simulations are not complete"):
            study.posterior()


def test_proposals_are_no_sample_of_the_prior() -> None:
    with pytest.raises(ChoiceError, match="trials were requested during the run"):
        LoadedStudy("calibrated", study_of("calibrated").store.results).sensitivity(
            "speed"
        )


def test_a_kernel_is_a_density_and_its_draws_follow_it() -> None:
    rng = np.random.default_rng(3)
    root = np.array([[0.1, 0.0], [0.06, 0.05]])
    kernel = ProposalKernel(
        np.array([[0.2, 0.5], [0.9, 0.9]]), np.array([0.3, 0.7]), root
    )
    draws, allowed = kernel.draw(20_000, rng, lambda some: some[:, 0] < 0.95)
    assert (draws >= 0.0).all()
    assert (draws < 1.0).all()
    assert draws[:, 0].max() < 0.95
    uniform = rng.random((200_000, 2))
    densities = np.where(uniform[:, 0] < 0.95, kernel.density(uniform), 0.0)
    error = densities.std() / math.sqrt(len(uniform))
    assert densities.mean() == pytest.approx(allowed, abs=SURE * error)
    # Draws weighted by one over their density are uniform: the mean of x is 0.475.
    ratio = allowed / kernel.density(draws)
    near = (np.abs(draws - [0.2, 0.5]) < 0.1).all(axis=1)
    volume = (ratio * near).mean()
    error = (ratio * near).std() / math.sqrt(len(draws))
    assert volume == pytest.approx(0.04, abs=SURE * error)


def test_a_kernel_without_an_allowed_draw_ends() -> None:
    kernel = ProposalKernel(np.array([[0.5]]), np.array([1.0]), np.array([[0.1]]))
    rng = np.random.default_rng(1)
    with pytest.raises(ValueError, match="hardly any draw"):
        kernel.draw(1, rng, lambda some: np.zeros(len(some), np.bool_))


def test_weights_of_all_generations_together_recover_the_prior() -> None:
    rng = np.random.default_rng(7)
    population = Population(500)
    draws = rng.random((2000, 1))
    population.add(draws, np.abs(draws[:, 0] - 0.3))
    for _ in range(3):
        kernel = population.kernel()
        draws, allowed = kernel.draw(500, rng, lambda some: some[:, 0] >= 0.0)
        population.add(draws, np.abs(draws[:, 0] - 0.3), kernel, allowed)
    weights = 1.0 / population.mixture(population.draws)
    assert weights.max() <= 3500 / 2000 * (1.0 + 1e-12)
    for end in (0.2, 0.5, 0.9):
        below = weights * (population.draws[:, 0] < end)
        error = below.std() / math.sqrt(len(below))
        assert below.mean() == pytest.approx(end, abs=SURE * error)
    kept = population.draws[population.nearest, 0]
    assert np.abs(kept - 0.3).max() == pytest.approx(population.tolerance)
    half = population.weights[kept < 0.3].sum()
    error = 0.5 / math.sqrt(population.effective)
    assert half == pytest.approx(0.5, abs=SURE * error)


def test_summaries_are_statistics_of_the_trials_with_a_value() -> None:
    values = np.array([[1.0, 2.0, 6.0], [1.0, np.nan, np.nan], [np.nan] * 3])
    assert Summary("speed", "mean").of(values).tolist()[:2] == [3.0, 1.0]
    assert np.isnan(Summary("speed", "mean").of(values)[2])
    deviations = Summary("speed", "sd").of(values)
    assert deviations[0] == pytest.approx(np.std([1, 2, 6], ddof=1))
    assert np.isnan(deviations[1:]).all()
    assert Summary("speed", 0.5).of(values).tolist()[:2] == [2.0, 1.0]
    assert Summary("speed", 0.25).words == "0.25 quantile of speed"
    assert Summary("delay", "sd", 2.0).words == "sd of delay at 2"


def test_a_value_between_positions_is_on_a_straight_line() -> None:
    positions, values = np.array([1.0, 2.0, 4.0]), np.array([3.0, 5.0, np.nan])
    read = {at: ProfilePoint("any", at).of(positions, values) for at in (1, 1.5, 2)}
    assert read == {1: 3.0, 1.5: 4.0, 2: 5.0}
    for at in (0.5, 3.0, 4.5):
        assert math.isnan(ProfilePoint("any", at).of(positions, values))
    assert math.isnan(ProfilePoint("any", 1.0).of(np.empty(0), np.empty(0)))


def test_distances_are_in_spreads_of_the_prior() -> None:
    rng = np.random.default_rng(2)
    summaries = rng.normal([5.0, 0.0], [2.0, 1e-3], (4000, 2))
    spread = spread_of(summaries)
    # The standard error of the scaled deviation of n normal values is 1.17 / sqrt(n).
    assert spread == pytest.approx([2.0, 1e-3], rel=SURE * 1.17 / math.sqrt(4000))
    assert spread_of(np.array([[1.0, 1.0], [1.0, 1.0], [1.0, 4.0]])).tolist() == [
        1.0,
        pytest.approx(math.sqrt(2.0)),
    ]
    distance = Distance.of_prior(rng.random((4000, 1)), summaries, learnt=False)
    away = distance.between(
        np.array([[5.0 + 2.0, 0.0], [np.nan, 0.0]]), np.array([5.0, 0.0])
    )
    assert away[0] == pytest.approx(2.0 / spread[0] / math.sqrt(2.0))
    assert away[1] == math.inf


def test_weighted_quantiles_of_equal_weights_are_usual_ones() -> None:
    values = np.random.default_rng(1).normal(size=999)
    weights = np.full(999, 1 / 999)
    found = quantiles(values, weights, (0.025, 0.5, 0.975))
    usual = np.quantile(values, (0.025, 0.5, 0.975), method="hazen")
    assert found == pytest.approx(usual.tolist())


def test_the_figure_has_the_parameters_and_says_what_was_not_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    posterior(tmp_path, monkeypatch, SMALL_TWO, ridge)
    figure = posterior_figure(LoadedStudy("fit", tmp_path))
    labels = {axes.get_xlabel() for axes in figure.axes}
    assert {"separation weight", "cohesion weight"} <= labels
    assert "not checked" in figure.get_supxlabel().replace("\n", " ")


def test_the_marks_of_the_explorer_are_all_simulations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = posterior(tmp_path, monkeypatch, SMALL_TWO, ridge)
    study = LoadedStudy("fit", tmp_path)
    assert KIND.marks
    drawn = KIND.marks(study, Choices())
    assert drawn.values == ("prior", "1", "2")
    assert [panel.x.name for panel in drawn.panels] == [
        "separation_weight",
        "cohesion_weight",
    ]
    for panel in drawn.panels:
        marks = panel.marks
        assert len(marks) == found.simulations
        assert marks["colour"].tolist() == found.simulated["generation"].tolist()
        # A kept simulation is no farther than the tolerance, and has a ring.
        assert (marks["y"] <= found.tolerance).equals(marks["best"])
        values = study.trials.groupby("point")[panel.x.name].first()
        assert marks["x"].tolist() == values[marks["point"]].tolist()
    with pytest.raises(ChoiceError, match="takes no metric"):
        KIND.marks(study, Choices(metrics=("speed",)))
    # The package that draws figures is an extra, and marks do without.
    monkeypatch.setattr(figure, "find_spec", lambda _name: None)
    assert KIND.suits(study, Choices(), as_marks=True) == ""
    assert "needs the package corner" in KIND.suits(study, Choices())
    with pytest.raises(ChoiceError, match="needs the package corner"):
        posterior_figure(study)
