"""Studies that add trials until an interval is narrow: the spec, the course of a
launch, and what is said of it.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

import sweep.workers.flying as flying_module
from sweep.analysis import by_point, mean_interval
from sweep.analysis.sequential import Width, looks, nominal_confidence
from sweep.campaigns.launching import launch
from sweep.campaigns.progress import Progress
from sweep.cli.listing import status_text
from sweep.cli.progress import ProgressBar
from sweep.cli.reporting import print_report
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.design.plan import make_plan
from sweep.errors import ChoiceError, SpecError
from sweep.methods.adaptive import stopping
from sweep.methods.adaptive.rule import Until, from_json, look
from sweep.methods.sensitivity import morris
from sweep.spec.schema import json_schema
from sweep.spec.study import parse_spec
from sweep.tables.means import point_means
from sweep.tables.means_text import means_report
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result, failed
from sweep.trial.simulation import run
from sweep.workers.executors import Loky, Serial
from tests.campaigns.test_launch import interrupting_after, same
from tests.cases import slow_but
from tests.specs import short, short_study
from tests.studies import IMPOSSIBLE, SMALL, launched, relaunch

RULE = "replicates: {until: {metric: speed, half_width: 0.4}, min: 3, max: 20}"
GROWING = SMALL.replace("replicates: 3", RULE).replace("[0.5, 1]", "[0.5, 1, 2, 4]")
NUMBERS = looks(3, 20)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    return launched(GROWING, tmp_path_factory.mktemp("whole"))


def identical(one: StoredStudy, other: StoredStudy) -> None:
    """Assert that two studies have the same plan, the same reasons to stop and the same
    bits.
    """
    assert one.plan.equals(other.plan)
    assert one.provenance["until"] == other.provenance["until"]
    pd.testing.assert_frame_equal(stopping(one), stopping(other), check_exact=True)
    same(one, other)


def half_widths(values: "pd.Series[float]") -> list[float]:
    """Of the intervals at all looks up to the number of values."""
    nominal = nominal_confidence(NUMBERS, 0.95)
    found = [mean_interval(values[:n], nominal) for n in NUMBERS if n <= len(values)]
    return [interval.high - interval.value for interval in found]


def test_each_point_stops_at_its_first_look_with_a_narrow_interval(
    whole: StoredStudy,
) -> None:
    """Worked out again from the stored values alone; points differ, so the rule has
    been at work.
    """
    assert stopping(whole)["n"].nunique() > 1
    for (_, point), (_, trials) in zip(
        stopping(whole).iterrows(),
        whole.trials.groupby("point", sort=False),
        strict=True,
    ):
        *before, last = half_widths(trials["speed"].to_numpy())
        assert list(trials["replicate"]) == list(range(point["n"]))
        assert point["n"] in NUMBERS
        assert (
            min(before) > 0.4 >= last == pytest.approx(point["half_width"], rel=1e-12)
        )
    assert stopping(whole)["reached"].all()
    assert set(stopping(whole)["why"]) == {"half width"}
    assert (
        len(whole.trials)
        == whole.plan.num_rows
        == stopping(whole)["n"].sum()
        == stopping(whole)["values"].sum()
    )


@pytest.mark.slow
def test_two_workers_make_the_same_decisions(
    whole: StoredStudy, tmp_path: Path
) -> None:
    engine = Loky(2)
    identical(launched(GROWING, tmp_path, engine), whole)
    engine.stop()


@pytest.mark.parametrize(
    "stop_after",
    slow_but([25], [0, 5, 14, 25, 30]),
)
def test_an_interrupted_launch_goes_on_to_the_same_decisions(
    whole: StoredStudy, tmp_path: Path, stop_after: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(flying_module, "run", interrupting_after(stop_after))
        with pytest.raises(KeyboardInterrupt):
            relaunch(GROWING, tmp_path)
    assert "not yet" in set(stopping(StoredStudy("small", tmp_path))["why"])
    assert relaunch(GROWING, tmp_path).stored > stop_after
    identical(StoredStudy("small", tmp_path), whole)


def test_trials_that_lack_the_metric_are_no_matter(
    whole: StoredStudy, tmp_path: Path
) -> None:
    """They are stored by an earlier spec that did not record it."""
    other = SMALL.replace("series: [speed]", "metrics: [polarization]")
    assert relaunch(other, tmp_path).trials == 6
    assert relaunch(GROWING, tmp_path).stored == 0
    study = StoredStudy("small", tmp_path)
    assert study.plan.equals(whole.plan)
    assert study.trials["speed"].equals(whole.trials["speed"])


def test_a_launch_again_runs_nothing(whole: StoredStudy) -> None:
    progress = relaunch(GROWING, whole.store.folder.parent)
    assert (progress.missing, progress.settled, progress.points) == (0, 4, 4)
    assert progress.trials == whole.plan.num_rows


def test_trials_of_a_fixed_number_are_used_and_those_beyond_stay_apart(
    whole: StoredStudy, tmp_path: Path
) -> None:
    relaunch(GROWING.replace(RULE, "replicates: 20"), tmp_path)
    progress = relaunch(GROWING, tmp_path)
    assert progress.missing == 0
    assert progress.apart == 4 * 20 - whole.plan.num_rows
    identical(StoredStudy("small", tmp_path), whole)
    assert relaunch(GROWING.replace(RULE, "replicates: 20"), tmp_path).missing == 0


def test_a_narrower_interval_needs_only_the_trials_beyond(
    whole: StoredStudy, tmp_path: Path
) -> None:
    wide = relaunch(GROWING.replace("0.4", "0.6"), tmp_path)
    progress = relaunch(GROWING, tmp_path)
    assert progress.stored == wide.trials
    assert progress.missing == whole.plan.num_rows - wide.trials > 0
    identical(StoredStudy("small", tmp_path), whole)


def test_a_point_whose_interval_stays_wide_stops_at_the_maximum(tmp_path: Path) -> None:
    study = launched(
        GROWING.replace("0.4", "1e-9").replace("max: 20", "max: 6"), tmp_path
    )
    assert set(stopping(study)["why"]) == {"max"}
    assert not stopping(study)["reached"].any()
    assert set(stopping(study)["n"]) == {6}


def test_points_without_a_value_are_given_up_at_the_first_look(tmp_path: Path) -> None:
    spec = IMPOSSIBLE.replace("replicates: 3", RULE)
    assert relaunch(spec, tmp_path).statuses == {"failed": 6}
    study = StoredStudy("small", tmp_path)
    assert set(stopping(study)["why"]) == {"too few values"}
    assert stopping(study)["half_width"].isna().all()
    assert relaunch(spec, tmp_path).missing == 0
    assert relaunch(spec, tmp_path, retry=True).statuses == {"failed": 6}


def test_trials_that_failed_are_no_values_and_a_retry_makes_up_for_them(
    whole: StoredStudy, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = list(stopping(whole)["point"])[:2]

    def failing(job: Job) -> Result:
        return (
            failed(job, "lost")
            if job.replicate < {first: 2, second: 1}.get(job.point, 0)
            else run(job)
        )

    with monkeypatch.context() as patch:
        patch.setattr(flying_module, "run", failing)
        relaunch(GROWING, tmp_path)
    points = stopping(StoredStudy("small", tmp_path)).set_index("point")
    assert tuple(points.loc[first, ["n", "values", "why"]]) == (
        3,
        1,
        "too few values",
    )
    assert points.loc[second, "values"] == points.loc[second, "n"] - 1 > 2
    assert points.loc[second, "why"] in ("half width", "max")
    progress = relaunch(GROWING, tmp_path, retry=True)
    assert progress.statuses.keys() == {"done"}
    identical(StoredStudy("small", tmp_path), whole)


def test_the_plan_lists_what_the_looks_so_far_have_asked_for(tmp_path: Path) -> None:
    """From the first look of all points on, it grows; each report comes with its plan
    on the disk.
    """
    seen: list[tuple[int, int | None, int]] = []

    def report(progress: Progress) -> None:
        assert StoredStudy("small", tmp_path).plan.num_rows == progress.trials
        seen.append(
            (
                progress.trials,
                progress.settled,
                progress.stored + progress.statuses.total(),
            )
        )

    launch(parse_spec(GROWING), tmp_path, Serial(), report=report)
    assert seen[0] == (12, 0, 0)
    assert seen == sorted(seen)
    assert seen[-1] == (seen[-1][0], 4, seen[-1][0])


def test_jobs_with_a_number_for_each_point_are_those_of_a_fixed_number() -> None:
    study = parse_spec(SMALL.replace("replicates: 3", "replicates: 5"))
    design = expand(study)
    every = {(job.point, job.replicate): job for job in Jobs(study, design)}
    jobs = Jobs(study, design, np.array([2, 4]))
    assert [job.replicate for job in jobs] == [0, 1, 0, 1, 2, 3]
    assert all(job == every[job.point, job.replicate] for job in jobs)
    table = jobs.table()
    assert [
        table[name].to_pylist() for name in ("trial_id", "point", "replicate", "seed")
    ] == [
        [getattr(job, name) for job in jobs]
        for name in ("trial_id", "point", "replicate", "seed")
    ]
    assert jobs[-1] == jobs[5]


def test_a_table_shows_the_repeated_interval_and_says_so(
    whole: StoredStudy, capsys: pytest.CaptureFixture[str]
) -> None:
    found = point_means(whole, ["speed", "flock_radius"])
    rows, names = found.rows, found.metrics
    declared = whole.distributions
    expected = by_point(
        whole.trials,
        whole.varied,
        names,
        repeated=whole.repeated,
        distributions=declared,
    )
    pd.testing.assert_frame_equal(rows.drop(columns="trial_id"), expected)
    usual = by_point(whole.trials, whole.varied, names, distributions=declared)
    assert (rows["speed_high"] - rows["speed"]).to_numpy() == pytest.approx(
        stopping(whole)["half_width"].to_numpy()
    )
    assert (rows["speed_high"] > usual["speed_high"]).all()
    pd.testing.assert_series_equal(
        rows["flock_radius_high"], usual["flock_radius_high"]
    )
    bootstrap = point_means(whole, names, interval="bootstrap").rows
    pd.testing.assert_series_equal(bootstrap["speed_high"], rows["speed_high"])
    print_report(means_report(whole, found))
    text = " ".join(capsys.readouterr().out.split())
    assert (
        "speed: mean ± half-width of the repeated 95 % confidence interval, which"
        " decided the number of trials" in text
    )
    assert (
        "other metrics: mean with the 95 % confidence interval for the distribution"
        " (sweep metrics); ± is the half-width of a Student's t interval, valid for"
        " fixed numbers of trials" in text
    )


def test_a_mean_over_the_last_half_may_decide(tmp_path: Path) -> None:
    study = launched(GROWING.replace("metric: speed", "metric: speed_mean"), tmp_path)
    rows = point_means(study, ["speed"], half=True).rows
    assert list(study.repeated) == ["speed_mean"]
    assert (rows["speed_mean_high"] - rows["speed_mean"]).to_numpy() == pytest.approx(
        stopping(study)["half_width"]
    )


SEVERAL = GROWING.replace(
    "{metric: speed, half_width: 0.4}", "{half_width: {speed: 0.5, flock_radius: 40%}}"
)


def test_several_metrics_are_all_narrow_where_a_point_stops(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Worked out again from the stored values alone."""
    study = launched(SEVERAL, tmp_path)
    nominal = nominal_confidence(NUMBERS, 0.975)
    assert study.repeated == {"speed": nominal, "flock_radius": nominal}
    assert len(stopping(study)) == 8
    assert stopping(study)["reached"].all()
    assert (
        stopping(study)["point"].tolist() == np.repeat(study.points.index, 2).tolist()
    )
    last = {}
    for point, part in study.trials.groupby("point"):
        for n in (one for one in NUMBERS if one <= len(part)):
            found = {
                name: mean_interval(
                    part[name][:n], nominal, distribution=study.distributions[name]
                )
                for name in ("speed", "flock_radius")
            }
            half = {name: (one.high - one.low) / 2 for name, one in found.items()}
            wide = half["speed"] > 0.5
            wide |= half["flock_radius"] > 0.4 * found["flock_radius"].value
            assert wide == (n < len(part)), (point, n)
        last[point] = half
    for _, row in stopping(study).iterrows():
        assert row["half_width"] == pytest.approx(last[row["point"]][row["metric"]])
    assert "settled   4 of 4 points, 4 by half width" in status_text(study)
    print_report(means_report(study, point_means(study)))
    said = " ".join(capsys.readouterr().out.split())
    assert "flock_radius, speed: mean with the repeated 95 % confidence" in said
    print_report(means_report(study, point_means(study, by=[])))
    said = " ".join(capsys.readouterr().out.split())
    assert "valid for fixed numbers of trials" in said
    plan = make_plan(parse_spec(SEVERAL), 2)
    assert (
        "until the half-width of speed is 0.5, of flock_radius is 40% of its mean)"
        in plan.as_text()
    )


def test_one_metric_by_name_is_the_rule_of_before() -> None:
    """So that its trials stay: the looks, their confidence, and what is stored."""
    before = parse_spec(GROWING).rule
    named = "{half_width: {speed: 0.4}}"
    after = parse_spec(GROWING.replace("{metric: speed, half_width: 0.4}", named)).rule
    assert before == after
    assert before
    assert before.nominal == nominal_confidence(NUMBERS, 0.95)
    old = {"metric": "speed", "half_width": 0.4, "confidence": 0.95}
    assert from_json(old | {"min": 3, "max": 20}) == before
    several = parse_spec(SEVERAL).rule
    assert several
    assert from_json(json.loads(json.dumps(several.as_json()))) == several


def test_more_metrics_than_hold_together_are_refused() -> None:
    widths = ", ".join(f"metric_{k}: 1" for k in range(11))
    with pytest.raises(SpecError, match=r'"half_width" has 11 metrics; at most 10 are'):
        parse_spec(spec_with(f"{{until: {{half_width: {{{widths}}}}}, max: 50}}"))


def test_a_point_waits_for_no_metric_without_values() -> None:
    rule = Until({"a": Width(1.0), "b": Width(0.1, relative=True)}, 0.95, 4, 8)
    trials = np.full(3, 4)
    values = {
        "a": np.array([0.0, 0.1, 0.2, 0.1] * 3),
        "b": np.array([np.nan] * 4 + [5.0, 5.1, 5.0, 5.1] + [5.0, 9.0, 5.0, 9.0]),
    }
    found = look(rule, rule.nominal, trials, values)
    assert found.further.tolist() == [4, 4, 5]
    assert found.metrics["b"].known.tolist() == [False, True, True]
    assert found.metrics["b"].allowed[1:] == pytest.approx([0.505, 0.7])


def test_what_is_said_before_during_and_after(
    whole: StoredStudy, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = make_plan(parse_spec(GROWING), workers=1)
    assert (
        "trials     12 to 80 (3 to 20 per point, until the half-width of speed is"
        " 0.4)" in plan.as_text()
    )
    assert "CPU time   at most about" in plan.as_text()
    with ProgressBar("small") as bar:
        progress = launch(parse_spec(GROWING), tmp_path, Serial(), report=bar.show)
    said = capsys.readouterr().err
    assert (
        "small: points settled 0 of 4, at most 80 trials; now 12 trials, 0 of them"
        " stored already" in said
    )
    assert bar.summary(progress, tmp_path).endswith("points settled 4 of 4")
    assert "settled   4 of 4 points, 4 by half width" in status_text(whole)


def test_a_study_of_a_fixed_number_has_no_stopping(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    assert study.repeated == {}
    with pytest.raises(ChoiceError, match="study small: the number of trials is fixed"):
        _ = stopping(study)


def test_elementary_effects_come_from_points_with_unlike_numbers_of_trials(
    tmp_path: Path,
) -> None:
    axis = (
        "j: {sample: morris, points: 2, separation_weight: {uniform: [0.5, 4]}, drag:"
        " {uniform: [0.1, 1]}}"
    )
    study = launched(
        GROWING.replace("separation_weight: [0.5, 1, 2, 4]", axis), tmp_path
    )
    assert stopping(study)["n"].nunique() > 1
    assert morris(study, "speed")["mu_star"].notna().all()


VALIDATOR = Draft7Validator(json_schema())


def spec_with(rule: str) -> str:
    return short(f"replicates: {rule}").replace("replicates: 2\n", "", 1)


def valid(text: str) -> bool:
    return VALIDATOR.is_valid(YAML(typ="safe", pure=True).load(text))


def test_a_rule_is_read_with_its_defaults() -> None:
    text = spec_with("{until: {metric: speed_mean, half_width: 2}, max: 50}")
    assert parse_spec(text).rule == Until({"speed_mean": Width(2.0)}, 0.95, 10, 50)
    assert parse_spec(text).trials_per_point == 50
    assert parse_spec(
        spec_with(
            "{until: {metric: speed, half_width: 1, confidence: 0.9}, min: 4, max: 4}"
        )
    ).rule
    assert short_study().rule is None
    assert valid(text)


@pytest.mark.parametrize(
    ("rule", "message", "shape"),
    [
        (
            "{until: {metric: sped, half_width: 1}, max: 50}",
            'unknown recorded metric "sped"; did you mean "speed"?',
            1,
        ),
        (
            "{until: {metric: coverage, half_width: 1}, max: 50}",
            'metric "coverage" is not recorded: list it under',
            1,
        ),
        (
            "{until: {metric: 3, half_width: 1}, max: 50}",
            '"metric" must be a string, not 3',
            0,
        ),
        (
            "{until: {metric: speed, half_width: 0}, max: 50}",
            '"half_width" must be a number above 0',
            0,
        ),
        (
            "{until: {metric: speed, half_width: wide}, max: 50}",
            '"half_width" must be a number above 0, in the unit of the metric, or a',
            0,
        ),
        ("{until: {metric: speed}, max: 50}", 'missing key "half_width" in "until"', 0),
        (
            "{until: {half_width: 1}, max: 50}",
            'needs "metric" with one "half_width", or a mapping from metrics to half-',
            0,
        ),
        (
            "{until: {metric: speed, half_width: {speed: 1}}, max: 50}",
            'needs "metric" with one "half_width", or a mapping from metrics to half-',
            0,
        ),
        (
            "{until: {half_width: {sped: 1, coverage: 5%}}, max: 50}",
            'unknown recorded metric "sped"; did you mean "speed"?',
            1,
        ),
        (
            "{until: {half_width: {speed: 5 percent}}, max: 50}",
            '"speed" must be a number above 0, in the unit of the metric, or a fract',
            0,
        ),
        (
            "{until: {half_width: {speed: 0%}}, max: 50}",
            '"speed" must be a number above 0, in the unit of the metric, or a fract',
            0,
        ),
        (
            "{until: {half_width: {speed: -1}}, max: 50}",
            '"speed" must be a number above 0',
            0,
        ),
        (
            "{until: {metric: speed, half_with: 1}, max: 50}",
            'unknown key "half_with"; did you mean "half_width"?',
            0,
        ),
        (
            "{until: {metric: speed, half_width: 1}}",
            'missing key "max" in "replicates"',
            0,
        ),
        (
            "{until: speed, max: 50}",
            '"until" must be a mapping with at least one entry, not "speed"',
            0,
        ),
        ("{min: 3, max: 50}", 'missing key "until" in "replicates"', 0),
        (
            "{until: {metric: speed, half_width: 1}, mx: 50}",
            'unknown key "mx"; did you mean "max"?',
            0,
        ),
        (
            "{until: {metric: speed, half_width: 1}, min: 2, max: 50}",
            '"min" must be an integer from 3',
            0,
        ),
        (
            "{until: {metric: speed, half_width: 1}, min: 51, max: 50}",
            '"min" must be at most "max", which is 50',
            1,
        ),
        (
            "{until: {metric: speed, half_width: 1}, max: 9}",
            '"max" is 9, below the default of "min", 10',
            1,
        ),
        (
            "{until: {metric: speed, half_width: 1}, max: 5.5}",
            '"max" must be an integer from 3',
            0,
        ),
        (
            "{until: {metric: speed, half_width: 1, confidence: 1}, max: 50}",
            '"confidence" must be a number from 0.5',
            0,
        ),
        (
            "{until: {metric: speed, half_width: 1, confidence: 95}, max: 50}",
            "to 0.999, not 95",
            0,
        ),
        ("0", '"replicates" must be an integer from 1', 0),
    ],
)
def test_what_is_wrong_with_a_rule_is_said_with_its_line(
    rule: str, message: str, shape: int
) -> None:
    """`shape` is 1 where only the spec as a whole shows the mistake, which editors do
    not mark.
    """
    with pytest.raises(SpecError) as caught:
        parse_spec(spec_with(rule))
    assert str(caught.value).startswith("spec.yaml:5: ")
    assert message in str(caught.value)
    assert valid(spec_with(rule)) == bool(shape)


def test_a_rule_and_seeds_exclude_each_other() -> None:
    with pytest.raises(
        SpecError,
        match=r'spec.yaml:6: give "replicates" or "seeds", not both',
    ):
        parse_spec(
            spec_with("{until: {metric: speed, half_width: 1}, max: 50}")
            + "seeds: [1, 2]\n"
        )


def test_a_search_has_a_fixed_number() -> None:
    text = spec_with("{until: {metric: speed, half_width: 1}, max: 50}\nsearch: {}")
    said = r'spec.yaml:6: a study with "until" takes no "search": "replicates" must be'
    with pytest.raises(SpecError, match=said):
        parse_spec(text)
