"""Profiles of a study: from the spec to tables, reports, figures and comparisons."""

import json
import math
import re
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.stats import ttest_ind

from kernels.profiles import PROFILES
from sweep import load
from sweep.analysis import mean_interval, simultaneous_confidence
from sweep.design import Job, Jobs, expand
from sweep.errors import ChoiceError, SpecError
from sweep.figures import KINDS, Choices, profile_figure
from sweep.methods.profiles import mean_profiles
from sweep.methods.profiles.analysis import SizeExponent, size_exponents
from sweep.methods.profiles.figure import draw_profile
from sweep.own_code import load_spec, study_of
from sweep.tables import JoinedStudies
from sweep.trial import run, simulation
from tests.commands import sweep
from tests.naive import profiles as naive
from tests.naive.profiles import Way
from tests.recordings.tracks import written

Floats = NDArray[np.float64]
OVERLAP = "neighbour_overlap"
SPEC = """\
study: my/profiles
model: vicsek1995
sweep: {noise: [0.5, 3]}
fixed: {n: 30, steps: 60}
replicates: 3
record:
  metrics: [polarization]
  every: 2
  trajectories: true
  profiles:
    - {name: pair_distribution, to: 2, bins: 8}
    - {name: velocity_correlation_function, to: 2, bins: 6}
    - {name: structure_factor, bins: 4}
    - {name: number_fluctuations, bins: 3}
    - {name: mean_squared_displacement, to: 20, bins: 4}
    - neighbour_overlap
    - {name: directional_delay, to: 6}
"""


def launched(folder: Path, spec: Mapping[str, Any]) -> str:
    """What a launch of a spec in a folder says."""
    (folder / "launched.yaml").write_text(json.dumps(spec), encoding="utf-8")
    ended = sweep(folder, "launch", "launched.yaml")
    assert ended.returncode == 0, ended.stderr
    return ended.stdout + ended.stderr


def jobs_of(spec: Mapping[str, Any], path: Path | None = None) -> list[Job]:
    study = study_of(spec, path) if path else study_of(spec)
    jobs = Jobs(study, expand(study))
    return [jobs.at(place) for place in range(len(jobs))]


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("profiles")
    (folder / "spec.yaml").write_text(SPEC, encoding="utf-8")
    assert sweep(folder, "launch", "spec.yaml").returncode == 0
    return folder


def test_values_are_those_of_the_averaged_frames(lab: Path) -> None:
    """The twins read the stored trajectories of the second half."""
    study = load("my/profiles", lab / "results")
    trial = study.profiles.iloc[0]
    frames = study.trajectories.query("trial_id == @trial.trial_id and frame > 30")
    bodies = np.array(
        [np.stack(frames[name].tolist()) for name in ("x", "y", "vx", "vy")]
    ).transpose(1, 0, 2)
    side = float(study.trials["width"].iloc[0])
    way = Way(bodies, side, side, periodic=True)
    axes = {
        "pair_distribution": np.linspace(0.0, 2.0, 9),
        "velocity_correlation_function": np.linspace(0.0, 2.0, 7),
        "structure_factor": np.linspace(0.5, 4.5, 5) * 2 * np.pi / side,
        "number_fluctuations": np.array([4.0, 3.0, 2.0]),
        "mean_squared_displacement": np.array([1.0, 2.0, 5.0, 10.0]),
        "neighbour_overlap": np.array([1.0, 2.0, 3.0]),
        "directional_delay": np.arange(4.0),
    }
    for name, axis in axes.items():
        twin: Callable[..., Floats] = getattr(naive, name)
        expected = twin(way, axis) * (2.0 if PROFILES[name].in_time else 1.0)
        np.testing.assert_allclose(trial[name], expected, rtol=1e-9, err_msg=name)
    at = {name: trial[f"{name}_at"].tolist() for name in axes}
    assert at["pair_distribution"] == pytest.approx(np.arange(8) / 4 + 0.125)
    assert at["number_fluctuations"] == pytest.approx([side / 4, side / 3, side / 2])
    assert at["mean_squared_displacement"] == [2.0, 4.0, 10.0, 20.0]
    assert at["directional_delay"] == list(range(30))


def test_trials_run_again_have_the_bits_of_stored_profiles(lab: Path) -> None:
    """Trials of a batch fly together; `verify` runs each alone."""
    ended = sweep(lab, "verify", "my/profiles", "--fraction", "1")
    assert "6 of 6 bitwise identical" in ended.stdout


def test_profiles_do_not_depend_on_kernel_calls(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    job = jobs_of({**parsed(SPEC), "study": "a/b"})[0]
    whole = run(job).profiles
    monkeypatch.setattr(simulation, "BOID_STEPS_A_CALL", 100)
    for name, values in run(job).profiles.items():
        assert values.value.tobytes() == whole[name].value.tobytes()


def parsed(text: str) -> dict[str, Any]:
    from sweep.spec import parse_document

    value: dict[str, Any] = parse_document(text, Path("spec.yaml")).value
    return value


def test_a_trial_without_trajectories_stores_none() -> None:
    spec = parsed(SPEC)
    del spec["record"]["trajectories"]
    result = run(jobs_of(spec)[0])
    assert result.trajectory is None
    assert result.states is None
    assert set(result.profiles) == {
        entry if isinstance(entry, str) else entry["name"]
        for entry in spec["record"]["profiles"]
    }


def test_fewer_profiles_run_no_trial_again(tmp_path: Path) -> None:
    spec = parsed(SPEC)
    spec["record"]["profiles"] = ["neighbour_overlap", "number_fluctuations"]
    assert "6 new trials" in launched(tmp_path, spec)
    spec["record"]["profiles"] = ["number_fluctuations"]
    assert "6 new trials" not in launched(tmp_path, spec)
    spec["record"]["profiles"] = [{"name": "number_fluctuations", "bins": 4}]
    assert "6 new trials" in launched(tmp_path, spec)


@pytest.mark.parametrize(
    ("record", "said"),
    [
        ({"profiles": ["pair_distributon"]}, 'did you mean "pair_distribution"?'),
        ({"profiles": ["polarization"]}, 'has no axis: list it under "metrics"'),
        ({"profiles": ["pair_distribution_of_sheep"]}, "with the kind sheep"),
        (
            {"profiles": [{"name": "number_fluctuations", "to": 3}]},
            '"to" has no effect on number_fluctuations',
        ),
        ({"profiles": [{"name": "pair_distribution", "to": -1}]}, "above 0"),
        ({"profiles": [{"name": "pair_distribution", "to": 1e308}]}, "below 1e+100"),
        ({"profiles": [{"name": "pair_distribution", "bin": 3}]}, '"bins"?'),
        (
            {"profiles": ["pair_distribution", {"name": "pair_distribution", "to": 1}]},
            "listed twice: pair_distribution",
        ),
        (
            {"profiles": ["pair_distribution"], "last_states": True},
            "keep no positions of earlier steps",
        ),
        ({"metrics": ["pair_distribution"]}, 'has an axis: list it under "profiles"'),
    ],
)
def test_a_wrong_profile_is_an_error(record: Mapping[str, Any], said: str) -> None:
    with pytest.raises(SpecError) as caught:
        study_of(parsed(SPEC) | {"record": record})
    assert said in str(caught.value)


def test_a_distance_beyond_half_of_a_torus_is_an_error() -> None:
    spec = parsed(SPEC)
    spec["record"]["profiles"] = [{"name": "pair_distribution", "to": 1000}]
    with pytest.raises(SpecError, match="half of the shorter side"):
        expand(study_of(spec))


def test_a_profile_of_a_kind_leaves_the_others_out() -> None:
    spec = {
        "study": "a/b",
        "model": "strombom2014",
        "fixed": {"n": 9, "steps": 20},
        "replicates": 1,
        "record": {
            "trajectories": True,
            "profiles": [{"name": "pair_distribution_of_sheep", "to": 30, "bins": 5}],
        },
    }
    job = jobs_of(spec)[0]
    result = run(job)
    assert result.trajectory is not None
    assert result.frames is not None
    sheep = result.trajectory[result.frames > 10][:, :, :-1]
    sides = (float(job.settings["width"]), float(job.settings["height"]))
    periodic = job.settings["borders"] == "torus"
    expected = naive.pair_distribution(
        Way(sheep, *sides, periodic), np.linspace(0.0, 30.0, 6)
    )
    values = result.profiles["pair_distribution_of_sheep"].value
    np.testing.assert_allclose(values, expected, rtol=1e-9)


OWN = textwrap.dedent(
    '''
    """Profiles of users."""

    from kernels.jit import jit
    from kernels.profiles import Profile


    @jit
    def spread(passage, axis, values):
        """Write the largest x in a frame."""
        for k in range(values.size):
            values[k] = 0.0
            for i in range(passage.x.shape[1]):
                values[k] = max(values[k], passage.x[int(axis[k]), i])


    PROFILES = {
        "largest_x": Profile(
            spread, axis="lag", unit="length", text="largest x", source="ours"
        )
    }
    '''
)


def test_a_file_next_to_the_spec_adds_a_profile(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(OWN, encoding="utf-8")
    spec = parsed(SPEC)
    spec["record"] = {"profiles": [{"name": "./mine.py", "to": 3}]}
    launched(tmp_path, spec)
    stored = load("my/profiles", tmp_path / "results")
    assert stored.profiles["largest_x_at"][0].tolist() == [1.0, 2.0, 3.0]
    found = mean_profiles(stored)
    assert found[0].text == "largest x"
    assert found[0].unit == "r"


def test_bounds_in_the_wrong_order_are_an_error(tmp_path: Path) -> None:
    text = OWN.replace('source="ours"', 'source="ours", low=1.0, high=0.0')
    (tmp_path / "mine.py").write_text(text, encoding="utf-8")
    spec = parsed(SPEC) | {"record": {"profiles": ["./mine.py"]}}
    with pytest.raises(SpecError, match="two numbers, the lower first"):
        study_of(spec, tmp_path / "spec.yaml")


def test_a_profile_with_an_unknown_axis_is_an_error(tmp_path: Path) -> None:
    text = OWN.replace('axis="lag"', 'axis="time"')
    (tmp_path / "mine.py").write_text(text, encoding="utf-8")
    spec = parsed(SPEC) | {"record": {"profiles": ["./mine.py"]}}
    with pytest.raises(
        SpecError, match='has the axis "time"; allowed: "distance", "lag"'
    ):
        study_of(spec, tmp_path / "spec.yaml")


def test_few_trials_have_bonferroni_intervals(lab: Path) -> None:
    study = load("my/profiles", lab / "results")
    (low, high) = mean_profiles(study, ["pair_distribution"])
    assert (low.settings, high.settings) == ({"noise": 0.5}, {"noise": 3.0})
    confidence = simultaneous_confidence(8)
    for k, column in enumerate(low.values.T):
        interval = mean_interval(column, confidence)
        assert low.value[k] == interval.value
        assert low.low[k] == max(interval.low, 0.0)
        assert low.high[k] == interval.high


def test_the_exponent_of_a_straight_way_is_two(lab: Path) -> None:
    """At low noise boids move almost straight on."""
    study = load("my/profiles", lab / "results")
    ordered, noisy = mean_profiles(study, ["mean_squared_displacement"])
    assert ordered.exponent is not None
    assert noisy.exponent is not None
    assert 1.95 < ordered.exponent.value <= 2.0
    assert noisy.exponent.value < ordered.exponent.value
    at = np.log(ordered.at)
    fits = [np.polyfit(at, np.log(row), 1)[0] for row in ordered.values]
    assert ordered.exponent.value == pytest.approx(np.mean(fits))
    part = mean_profiles(study, ["mean_squared_displacement"], start=4.0, stop=20.0)[0]
    fits = [np.polyfit(at[1:], np.log(row[1:]), 1)[0] for row in ordered.values]
    assert part.exponent is not None
    assert part.exponent.value == pytest.approx(np.mean(fits))


def test_the_correlation_length_is_the_first_zero(lab: Path) -> None:
    study = load("my/profiles", lab / "results")
    mean = mean_profiles(study, ["velocity_correlation_function"])[0]
    zeros = []
    for row in mean.values:
        signs = np.flatnonzero(row <= 0.0)
        if signs.size and signs[0] > 0:
            k = signs[0]
            slope = (row[k] - row[k - 1]) / (mean.at[k] - mean.at[k - 1])
            zeros.append(mean.at[k - 1] - row[k - 1] / slope)
    assert mean.zero is not None
    assert mean.zero.n == len(zeros) > 0
    assert mean.zero.value == pytest.approx(np.mean(zeros))


def test_the_command_prints_means_and_exponents(lab: Path) -> None:
    text = sweep(lab, "profiles", "my/profiles:noise=3").stdout
    assert "my/profiles: pair_distribution" in text
    assert "exponent" in text
    assert "correlation length" in text
    assert "\n│ 0.5 " not in text
    facts = json.loads(sweep(lab, "profiles", "my/profiles", "--json").stdout)
    assert {row["quantity"] for row in facts["derived"]} == {
        "exponent",
        "correlation length",
    }
    names = {row["profile"] for row in facts["profiles"]}
    assert len(names) == 7
    ended = sweep(lab, "profiles", "my/profiles", "--profile", "pair")
    assert ended.returncode != 0
    assert 'unknown profile "pair"' in ended.stderr


def test_two_points_are_compared_at_each_position(lab: Path) -> None:
    sides = ("my/profiles:noise=0.5", "my/profiles:noise=3")
    text = sweep(lab, "profiles", *sides, "--json").stdout
    rows = pd.DataFrame(json.loads(text)["differences"])
    assert set(rows["profile"]) == set(PROFILES) - {"directional_delay"}
    moved = rows[rows["profile"] == "mean_squared_displacement"]
    assert moved["differs"].all()
    assert (moved["difference"] == moved["b"] - moved["a"]).all()
    ended = sweep(lab, "profiles", "my/profiles", "my/profiles:noise=3")
    assert "has 2 points; choose one, for example my/profiles:noise=0.5" in ended.stderr


def test_other_positions_are_not_compared(lab: Path) -> None:
    spec = parsed(SPEC) | {"study": "my/others"}
    spec["record"]["profiles"] = [{"name": "pair_distribution", "to": 1, "bins": 8}]
    launched(lab, spec)
    sides = ("my/profiles:noise=3", "my/others:noise=3")
    ended = sweep(lab, "profiles", *sides)
    assert "pair_distribution has other positions in A than in B" in ended.stderr


def test_trials_of_an_earlier_spec_may_lack_a_profile(tmp_path: Path) -> None:
    spec = parsed(SPEC)
    spec["record"]["profiles"] = ["neighbour_overlap", "number_fluctuations"]
    launched(tmp_path, spec)
    spec["record"]["profiles"] = ["number_fluctuations"]
    spec["replicates"] = 5
    launched(tmp_path, spec)
    means = mean_profiles(load("my/profiles", tmp_path / "results"))
    counts = {(mean.name, len(mean.values)) for mean in means}
    assert ("number_fluctuations", 5) in counts
    ended = sweep(
        tmp_path, "export", "my/profiles", "--table", "profiles", "--to", "p.csv"
    )
    assert ended.returncode == 0, ended.stderr


def test_motionless_boids_are_drawn(tmp_path: Path) -> None:
    """No logarithmic axis has a place for 0."""
    written(tmp_path, [(a, t / 10, a, 1) for t in range(20) for a in range(3)])
    spec = {
        "study": "lab/still",
        "recording": {"files": ["tracks.csv"], "time_step": 0.1},
        "record": {"profiles": ["mean_squared_displacement"]},
    }
    launched(tmp_path, spec)
    study = load("lab/still", tmp_path / "results")
    figure = profile_figure(study, "mean_squared_displacement")
    assert figure.axes[0].get_xscale() == "linear"
    figure.draw_without_rendering()


@pytest.mark.parametrize(
    ("profile", "keys", "said"),
    [
        ({"name": "mean_squared_displacement", "to": 50}, {}, "beyond the second half"),
        ({"name": "mean_squared_displacement", "to": 1}, {}, "below the time between"),
        ({"name": "structure_factor", "to": 0.1}, {}, "below that of the longest wave"),
        (
            "neighbour_overlap",
            {"every": 61},
            "profiles need a frame in the second half",
        ),
        ({"name": "directional_delay", "bins": 3}, {}, '"bins" has no effect'),
    ],
)
def test_an_axis_that_cannot_be_measured_is_an_error(
    profile: object, keys: Mapping[str, Any], said: str
) -> None:
    spec = parsed(SPEC)
    spec["record"] = {"profiles": [profile], "every": 2} | keys
    with pytest.raises(SpecError) as caught:
        expand(study_of(spec))
    assert said in str(caught.value)


def test_a_zero_that_some_trials_lack_has_no_interval(lab: Path) -> None:
    study = load("my/profiles", lab / "results")
    mean = mean_profiles(study, ["velocity_correlation_function"], stop=0.4)[0]
    assert mean.zero is not None
    assert np.isnan(mean.zero.low)


def test_odd_describes_profiles(lab: Path) -> None:
    for described in ("my/profiles", "spec.yaml"):
        text = sweep(lab, "odd", described).stdout
        assert "| mean_squared_displacement | lag | r^2 | mean square of" in text


def test_an_export_has_a_row_per_value(lab: Path) -> None:
    ended = sweep(lab, "export", "my/profiles", "--table", "profiles", "--to", "p.csv")
    assert ended.returncode == 0, ended.stderr
    rows = pd.read_csv(lab / "p.csv")
    study = load("my/profiles", lab / "results")
    for _, trial in study.profiles.iterrows():
        own = rows[rows["trial_id"] == trial["trial_id"]]
        for name in PROFILES:
            of_name = own[own["profile"] == name]
            assert of_name["value"].tolist() == pytest.approx(trial[name], rel=1e-15)
            assert of_name["at"].tolist() == pytest.approx(trial[f"{name}_at"])
    units = rows.groupby("profile")[["axis", "axis_unit", "unit"]].first()
    moved = units.loc["mean_squared_displacement"].tolist()
    assert moved == ["lag", "step", "r^2"]
    ended = sweep(lab, "export", "my/profiles", "--table", "profiles", "--to", "p.nc")
    assert "profiles have different axes: write .csv" in ended.stderr


def test_a_recording_is_compared_with_a_model(tmp_path: Path) -> None:
    """A quarter of an hour of a new user: tracks, a model, one command."""
    random = np.random.default_rng(3)
    rows = []
    for event in range(4):
        way = random.random((2, 6)) * 4 + random.normal(0, 0.05, (30, 2, 6)).cumsum(0)
        rows += [
            (animal, frame / 10, *way[frame, :, animal], event)
            for frame in range(30)
            for animal in range(6)
            if (frame, animal, event) != (7, 2, 1)
        ]
    written(tmp_path, rows, "id,t,x,y,event")
    record = {"profiles": [{"name": "mean_squared_displacement", "to": 1, "bins": 3}]}
    recording = {"files": ["tracks.csv"], "time_step": 0.1}
    recording["columns"] = {"event": "event"}
    spec = {"study": "lab/tracks", "recording": recording, "record": record}
    (tmp_path / "tracks.yaml").write_text(json.dumps(spec), encoding="utf-8")
    model = {
        "study": "my/model",
        "model": "couzin2002",
        "fixed": {"n": 6, "steps": 60, "dt": 0.1},
        "replicates": 4,
        "record": record,
    }
    (tmp_path / "model.yaml").write_text(json.dumps(model), encoding="utf-8")
    for name in ("tracks", "model"):
        ended = sweep(tmp_path, "launch", f"{name}.yaml")
        assert ended.returncode == 0, ended.stderr
    tracks = load("lab/tracks", tmp_path / "results")
    event = load_spec(tmp_path / "tracks.yaml")
    bodies = run(Jobs(event, expand(event)).at(0)).profiles
    name = "mean_squared_displacement"
    assert bodies[name].value.tobytes() == tracks.profiles[name][0].tobytes()
    ended = sweep(tmp_path, "profiles", "lab/tracks", "my/model")
    assert "mean_squared_displacement is in m^2 in A" in ended.stderr


def test_events_of_different_lengths_have_equal_lags(tmp_path: Path) -> None:
    """The shortest event determines the lags, unless the spec does."""
    rows = [
        (animal, frame / 10, frame + animal, animal, event)
        for event, frames in enumerate((400, 161))
        for frame in range(frames)
        for animal in range(3 - event)
    ]
    written(tmp_path, rows, "id,t,x,y,event")
    recording = {"files": ["tracks.csv"], "time_step": 0.1}
    recording["columns"] = {"event": "event"}
    names = ["mean_squared_displacement", "directional_delay"]
    spec = {
        "study": "lab/tracks",
        "recording": recording,
        "record": {"profiles": names},
    }
    launched(tmp_path, spec)
    study = load("lab/tracks", tmp_path / "results")
    first, second = study.profiles["mean_squared_displacement_at"]
    assert first.tolist() == second.tolist()
    assert first[-1] == pytest.approx(4.0)
    (moved,) = mean_profiles(study, ["mean_squared_displacement"])
    np.testing.assert_allclose(moved.values, [(10 * moved.at) ** 2] * 2, rtol=1e-9)


def test_a_mean_over_events_is_that_of_individuals_of_one_name(tmp_path: Path) -> None:
    """Each pigeon follows the one before by a frame; two pigeons are in one event."""
    order = {"first": ("ada", "bea", "cleo"), "second": ("cleo", "ada", "$x$")}
    rows = []
    for event, names in order.items():
        for place, name in enumerate(names):
            for frame in range(60):
                angle = 0.2 * math.sin(0.2 * (frame - place))
                velocity = math.cos(angle), math.sin(angle)
                rows.append((name, frame, frame, place, event, *velocity))
    written(tmp_path, rows, "id,t,x,y,event,vx,vy")
    columns = {"event": "event", "vx": "vx", "vy": "vy"}
    recording = {"files": ["tracks.csv"], "time_step": 1.0, "velocities": "given"}
    delay = {"name": "directional_delay", "to": 5}
    spec = {
        "study": "lab/pigeons",
        "recording": recording | {"columns": columns},
        "record": {"profiles": [delay]},
    }
    launched(tmp_path, spec)
    study = load("lab/pigeons", tmp_path / "results")
    (mean,) = mean_profiles(study)
    expected = {"ada": [1.5, 0.0], "bea": [0.0], "cleo": [-1.5, 1.5], "$x$": [-1.5]}
    assert dict(zip(mean.individuals, mean.value.tolist(), strict=True)) == {
        name: np.mean(delays) for name, delays in expected.items()
    }
    assert np.isfinite(mean.values).sum(axis=0).tolist() == [2, 1, 2, 1]
    shown = sweep(tmp_path, "profiles", "lab/pigeons")
    assert re.search(r"cleo +│ 0 \(.* 2 ", shown.stdout), shown.stdout
    found = json.loads(sweep(tmp_path, "profiles", "lab/pigeons", "--json").stdout)
    assert [row["individual"] for row in found["profiles"]] == list(expected)
    axes = profile_figure(study, "directional_delay").axes[0]
    ticks = [tick.get_text() for tick in axes.get_xticklabels()]
    assert ticks == ["ada", "bea", "cleo", r"\$x\$"]


def test_marks_of_individuals_have_the_names_of_the_measured_kind(
    tmp_path: Path,
) -> None:
    """The sheep come after the dog among all individuals."""
    kinds = {"rex": "dog", "$a$": "sheep", "b": "sheep"}
    rows = [
        (name, frame, frame + math.sin(frame), place, kind)
        for place, (name, kind) in enumerate(kinds.items())
        for frame in range(40)
    ]
    written(tmp_path, rows, "id,t,x,y,kind")
    recording = {"files": ["tracks.csv"], "time_step": 1, "columns": {"kind": "kind"}}
    record = {"profiles": ["directional_delay_of_sheep"]}
    launched(tmp_path, {"study": "lab/f", "recording": recording, "record": record})
    marks = KINDS["profiles"].marks
    assert marks
    shown = marks(load("lab/f", tmp_path / "results"), Choices())
    (panel,) = shown.panels
    assert shown.form == "points"
    assert panel.x.names == ("$a$", "b")
    assert panel.marks["x"].tolist() == [0, 1]


def test_a_profile_that_no_individual_has_is_shown_without_values(
    tmp_path: Path,
) -> None:
    """One dog has no other to lead. Delays are not compared, and that is said."""
    for name in ("dogs", "others"):
        record = {"metrics": ["speed"], "profiles": ["directional_delay_of_dog"]}
        record["profiles"].append("velocity_correlation_function_of_sheep")
        spec = {"study": f"lab/{name}", "model": "strombom2014", "replicates": 2}
        launched(tmp_path, spec | {"fixed": {"steps": 20, "n": 8}, "record": record})
    shown = sweep(tmp_path, "profiles", "lab/dogs")
    assert (shown.returncode, shown.stderr) == (0, "")
    compared = sweep(tmp_path, "profiles", "lab/dogs", "lab/others")
    assert "directional_delay_of_dog: individuals of A are not" in compared.stdout
    study = load("lab/dogs", tmp_path / "results")
    assert profile_figure(study, "directional_delay_of_dog").axes


def test_a_wide_band_leaves_the_means_in_view(lab: Path) -> None:
    """One of a few positions is known badly. A band that is as wide as the others stays
    whole, also where all means are equal.
    """
    study = load("my/profiles", lab / "results")
    means = mean_profiles(study, ["velocity_correlation_function"])
    at = np.arange(5.0)
    value = np.array([0.5, 0.4, 0.2, 0.1, 0.0])
    half = np.array([0.1, 0.1, 0.1, 0.1, 40.0])
    wide = replace(means[0], at=at, value=value, low=value - half, high=value + half)
    low, high = draw_profile(study, [wide]).axes[0].get_ylim()
    assert (low, high) == pytest.approx((-0.5, 1.0))
    level = np.full(5, 0.3)
    flat = replace(means[0], at=at, value=level, low=level - 2, high=level + 2)
    low, high = draw_profile(study, [flat]).axes[0].get_ylim()
    assert low < -1.7 < 2.3 < high


def test_a_figure_of_two_studies_has_a_line_for_each(lab: Path, tmp_path: Path) -> None:
    """Positions may differ, not units; individuals are never compared."""
    other = SPEC.replace("my/profiles", "my/other").replace(
        "to: 2, bins: 8", "to: 2.5, bins: 8"
    )
    (tmp_path / "other.yaml").write_text(other, encoding="utf-8")
    where = ("--results", str(lab / "results"))
    assert sweep(tmp_path, "launch", "other.yaml", *where).returncode == 0
    parts = [load(name, lab / "results") for name in ("my/profiles", "my/other")]
    first, second = (part.where(noise=3) for part in parts)
    joined = JoinedStudies([first, second])
    planned = KINDS["profiles"].figures(joined, Choices())
    assert [figure.metric for figure in planned] == list(PROFILES)[:-1]
    axes = planned[0].draw().axes[0]
    ends = [line.get_xdata()[-1] for line in axes.get_lines()]
    assert ends == pytest.approx([1.875, 2.34375])
    labels = axes.get_legend_handles_labels()[1]
    assert labels == [f"study = {part.name} (3 trials)" for part in (first, second)]


def test_the_figure_has_a_line_and_a_band_per_point(lab: Path) -> None:
    study = load("my/profiles", lab / "results")
    figure = profile_figure(study, "mean_squared_displacement")
    (axes,) = figure.axes
    assert axes.get_xscale() == "log"
    assert axes.get_xlabel() == "lag (step)"
    assert axes.get_ylabel() == "mean squared displacement (r²)"
    assert len(axes.lines) == 2
    assert len(axes.collections) == 2
    with pytest.raises(ChoiceError, match="unknown profile"):
        profile_figure(study, "polarization")


def test_a_study_of_many_points_has_a_line_for_each(lab: Path) -> None:
    """Each line has a style of its own; more lines than colours are refused."""
    spec = parsed(SPEC) | {"study": "my/many", "replicates": 2}
    spec["sweep"] = {"noise": [0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4]}
    spec["record"] = {"profiles": ["neighbour_overlap"], "every": 2}
    launched(lab, spec)
    study = load("my/many", lab / "results")
    few = study.where("noise < 4")
    styles = [
        line.get_linestyle() for line in profile_figure(few, OVERLAP).axes[0].lines
    ]
    assert len(styles) == 7
    assert len(set(styles)) >= 4
    with pytest.raises(ChoiceError, match="has 8 points; allowed: up to 7 lines"):
        profile_figure(study, OVERLAP)
    assert "8 points" in KINDS["profiles"].suits(study, Choices())


def test_marks_are_the_means_of_each_position(lab: Path) -> None:
    """The explorer draws them; individuals have names instead of positions."""
    study = load("my/profiles", lab / "results")
    marks = KINDS["profiles"].marks
    assert marks
    shown = marks(study, Choices())
    assert shown.form == "lines"
    assert [panel.y.name for panel in shown.panels] == list(PROFILES)[:-1]
    assert shown.note.endswith("only in `sweep plot`: directional_delay")
    assert shown.values == ("noise = 0.5", "noise = 3")
    for panel in shown.panels:
        for number, mean in enumerate(mean_profiles(study, [panel.y.name])):
            own = panel.marks[panel.marks["point"] == mean.point]
            assert set(own["colour"]) == {number}
            for column, values in (
                ("x", mean.at),
                ("y", mean.value),
                ("low", mean.low),
                ("high", mean.high),
            ):
                np.testing.assert_array_equal(own[column], values)
        assert panel.x.logarithmic == panel.y.logarithmic
    assert [panel.y.name for panel in shown.panels if panel.y.logarithmic] == [
        "number_fluctuations",
        "mean_squared_displacement",
    ]


def test_the_growth_of_a_length_is_a_slope_of_logarithms() -> None:
    """Two sizes have Welch's interval. Of three sizes with equal spreads, the slope is
    that of all trials. A trial without a zero, or two worlds of one side, have none.
    """
    random = np.random.default_rng(8)

    def growth(**zeros: Floats) -> list[SizeExponent]:
        sides = [float(name.split("_")[1]) for name in zeros]
        points = {"point": list(zeros), "width": sides, "height": sides}
        study = Mock(trials=pd.DataFrame(points))
        profiles = [
            Mock(
                point=name,
                settings={"n": side, "width": side, "height": side, "noise": 0.5},
                zeros=own,
                zero=mean_interval(own),
                axis="distance",
            )
            for (name, own), side in zip(zeros.items(), sides, strict=True)
        ]
        for profile in profiles:
            profile.name = "velocity_correlation_function"
        return size_exponents(study, profiles)

    def zeros(side: float, trials: int) -> Floats:
        lengths: Floats = side**0.8 * np.exp(random.normal(0, 0.1, trials))
        return lengths

    small, middle, large = zeros(10, 8), zeros(15, 8), zeros(20, 12)
    (of_two,) = growth(b_20=large, a_10=small)
    assert of_two.settings == {"noise": 0.5}
    assert of_two.sides == [10.0, 20.0]
    tested = ttest_ind(np.log(large), np.log(small), equal_var=False)
    interval = tested.confidence_interval()
    expected = np.array([interval.low, interval.high]) / math.log(2)
    assert of_two.exponent[1:3] == pytest.approx(expected)
    (of_three,) = growth(a_10=small, b_15=middle, c_20=large[:8])
    x = np.repeat(np.log([10.0, 15.0, 20.0]), 8)
    y = np.log(np.concatenate([small, middle, large[:8]]))
    assert of_three.exponent.value == pytest.approx(np.polyfit(x, y, 1)[0])
    assert of_three.exponent.n == 24
    (lost,) = growth(a_10=small, b_20=np.append(large[1:], np.nan))
    assert np.isnan(lost.exponent.value)
    assert lost.exponent.n == 19
    assert growth(a_10=small, b_10=middle) == []


def test_flocks_of_several_sizes_have_an_exponent_in_the_report(lab: Path) -> None:
    """Correlations of a flock reach in proportion to its size (Cavagna et al. 2010)."""
    spec = parsed(SPEC) | {"study": "my/sizes", "replicates": 6, "sizes": {}}
    spec["sizes"] = {"n": [64, 256], "density": 3}
    spec["sweep"] = {"noise": [0.5]}
    spec["fixed"] = {"steps": 200}
    spec["record"] = {"profiles": ["velocity_correlation_function"], "every": 10}
    launched(lab, spec)
    asked = ("profiles", "my/sizes", "--start", "0.3")
    (growth,) = json.loads(sweep(lab, *asked, "--json").stdout)["sizes"]
    assert growth["low"] < growth["exponent"] < growth["high"]
    assert 0.5 < growth["exponent"] < 2.0
    assert (growth["sizes"], growth["trials"]) == (2, 12)
    text = sweep(lab, *asked).stdout
    assert "my/sizes: growth with the side of the world" in text


def test_a_study_without_profiles_says_how_to_record_them(tmp_path: Path) -> None:
    spec = parsed(SPEC)
    spec["record"] = {"metrics": ["polarization"]}
    launched(tmp_path, spec)
    study = load("my/profiles", tmp_path / "results")
    assert study.profiles.empty
    with pytest.raises(ChoiceError, match=r"record: \{profiles: \[...\]\}"):
        mean_profiles(study)
