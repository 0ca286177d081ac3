"""A start, a sampler of points, a distribution, a sampler of a search, a statistic and
a kind of figure are entered in one place each. That nobody else knows any of them by
name is a rule of tests/house/names.py.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import optuna
import pandas as pd
import pytest
from jsonschema import Draft7Validator
from matplotlib.figure import Figure
from numpy.random import Generator

from kernels.settings import Demand, StartSettings
from kernels.starts import STARTS, Start
from kernels.state import Flock, World, empty_flock
from kernels.worlds import Reach
from sweep.errors import ChoiceError, SpecError, StoreError
from sweep.figures.kinds import KINDS, plan_figures
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.scales import is_logarithmic
from sweep.figures.selection import select
from sweep.methods.search.asked_trials import read_asked
from sweep.methods.search.exporting import export
from sweep.methods.search.figure import history_figure
from sweep.methods.search.known_samplers import (
    SEARCH_SAMPLERS,
    Need,
    SearchSampler,
    Sought,
)
from sweep.methods.search.report import search_report
from sweep.methods.search.statistics import STATISTICS, Floats, StatisticKind
from sweep.methods.sensitivity import sensitivity
from sweep.spec.contents import Whole
from sweep.spec.distributions import DISTRIBUTIONS, Distribution
from sweep.spec.keys import Key
from sweep.spec.samplers import SAMPLERS
from sweep.spec.sampling import BlockRules, BlockSize, Sampler, Unit, UnitCube
from sweep.spec.schema import json_schema
from sweep.spec.settings import Setting, settings_of
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import parse_spec
from sweep.spec.whole_samples import TRAJECTORY, morris
from sweep.tables.stored_study import StoredStudy
from sweep.web.live_show import Live
from sweep.web.state import begin
from tests import ROOT
from tests.cases import slow_but
from tests.commands import sweep
from tests.house.names import REGISTRIES
from tests.plotted import made_up
from tests.reports import as_text
from tests.sampled import axis as joint_axis
from tests.sampled import study_of
from tests.searches import (
    ANALYTIC,
    BEST,
    TINY,
    analytic,
    asked_by,
    edited,
    replace_trials,
)
from tests.specs import short


def test_an_entry_says_what_it_is_and_a_guide_names_it() -> None:
    """But for starts, which are choices of a setting, as `sweep models` lists them."""
    pages = [ROOT / "README.md", *ROOT.glob("docs/guide/*.md")]
    guide = "".join(page.read_text(encoding="utf-8") for page in pages)
    entries = [one for registry in REGISTRIES for one in registry.items()]
    named = [name for registry in REGISTRIES[1:] for name in registry]
    assert REGISTRIES[0] is STARTS
    assert all(REGISTRIES)
    assert [name for name, entry in entries if not entry.text] == []
    assert [name for name in named if not re.search(rf"\b{name}\b", guide)] == []


def refusal(spec: str) -> str:
    with pytest.raises(SpecError) as error:
        parse_spec(spec)
    return str(error.value)


def accepts(spec: str) -> bool:
    """Whether the schema does."""
    value = parse_document(spec, Path("spec.yaml")).value
    return bool(Draft7Validator(json_schema()).is_valid(value))


def commanded(folder: Path, *words: str) -> str:
    """What a command that succeeds says, in lines of any width."""
    done = sweep(folder, *words)
    assert done.returncode == 0, (words, done.stderr)
    return done.stdout + done.stderr


def in_a_row(
    n: int,
    settings: StartSettings,
    world: World,
    _contact: Reach,
    _rng: Generator,
    _seed: int,
) -> Flock:
    """Boids side by side in the middle of the world, which fly upwards."""
    flock = empty_flock(n)
    flock.x[:] = world.width * (np.arange(n) + 0.5) / n
    flock.y[:] = world.height / 2
    flock.vy[:] = settings.start_speed
    return flock


@pytest.fixture
def row(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    margin = Demand("start_margin == 0", "a row needs start_margin 0")
    start = Start(in_a_row, "side by side, upwards", "this test", (margin,))
    monkeypatch.setitem(STARTS, "in_a_row", start)
    settings_of.cache_clear()
    yield
    settings_of.cache_clear()


ROW = short(
    "fixed: {n: 4, steps: 6, map: empty}",
    "sweep: {start_draws: [numpy, in_a_row]}",
    "record: {metrics: [polarization], series: [polarization], trajectories: true}",
)


@pytest.mark.usefixtures("row")
def test_a_new_start_goes_through_every_command(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(ROW)
    assert "in_a_row" in commanded(tmp_path, "models", "nguyen2024")
    assert "points     2" in commanded(tmp_path, "plan", "spec.yaml")
    assert "4 done" in commanded(tmp_path, "launch", "spec.yaml")
    assert "in_a_row" in commanded(tmp_path, "table", "short")
    assert "curves.png" in commanded(tmp_path, "plot", "short", "curves")
    study = StoredStudy("short", tmp_path / "results")
    trials = study.trials[study.trials["start_draws"] == "in_a_row"]
    width, height = trials[["width", "height"]].iloc[0]
    for trial in trials["trial_id"]:
        _, flight = study.trajectory(trial)
        np.testing.assert_allclose(flight[0, 0] / width, [0.125, 0.375, 0.625, 0.875])
        assert (flight[0, 1] == height / 2).all()
        assert "bitwise identical" in commanded(tmp_path, "replay", "short", trial)


@pytest.mark.usefixtures("row")
def test_specs_know_a_new_start_and_what_it_demands() -> None:
    assert "in_a_row" in refusal(ROW.replace("in_a_row", "in_a_rw"))
    assert 'did you mean "in_a_row"?' in refusal(ROW.replace("in_a_row", "in_a_rw"))
    assert accepts(ROW)
    assert not accepts(ROW.replace("in_a_row", "in_a_rw"))
    assert "in_a_row: side by side, upwards" in json.dumps(json_schema())


@pytest.mark.usefixtures("row")
def test_the_demands_of_a_new_start_are_checked(tmp_path: Path) -> None:
    for margin, code in (("3", 2), ("0", 0)):
        text = ROW.replace("{n: 4,", f"{{start_margin: {margin}, n: 4,")
        (tmp_path / "spec.yaml").write_text(text)
        done = sweep(tmp_path, "plan", "spec.yaml")
        assert done.returncode == code
        assert ("a row needs start_margin 0" in done.stderr) == bool(code)


@pytest.mark.usefixtures("row")
def test_the_page_shows_a_new_start() -> None:
    state = begin("nguyen2024").with_settings({"start_draws": "in_a_row", "n": 4})
    show = Live(state)
    controls, scene, _ = show.greeting()
    (group,) = (one for one in controls["groups"] if one["name"] == "start")
    (control,) = (one for one in group["fields"] if one["name"] == "start_draws")
    assert control["choices"] == [
        "numpy",
        "python_random",
        "portable",
        "ordered",
        "opposite",
        "around_goal",
        "in_a_row",
    ]
    assert "side by side" in control["text"]
    assert (show.simulation.flock.y == scene["height"] / 2).all()


def middles(cube: UnitCube) -> list[Unit]:
    """The middles of equal intervals, in another order for each setting."""
    return [
        (cube.generator(name).permutation(cube.points) + 0.5) / cube.points
        for name in cube.names
    ]


def reversed_walks(cube: UnitCube) -> list[Unit]:
    """Morris's trajectories on four levels, mirrored."""
    return [1.0 - unit for unit in morris(cube)]


@pytest.fixture
def points_sampler(monkeypatch: pytest.MonkeyPatch) -> None:
    sampler = Sampler(
        middles,
        "the middles of intervals",
        lambda points: "few points" if points < 8 else "",
    )
    monkeypatch.setitem(SAMPLERS, "middles", sampler)


@pytest.fixture
def walks_sampler(monkeypatch: pytest.MonkeyPatch) -> None:
    def read(entry: Any) -> tuple[BlockSize, int]:
        steps = entry.get("stairs")
        return TRAJECTORY, 2 * steps.whole(1, 9) if steps else 4

    stairs = Key(Whole(1, 9), "half of the levels", name="stairs", otherwise="2")
    rules = BlockRules("walks", (TRAJECTORY,), read, (stairs,), leveled=True)
    sampler = Sampler(reversed_walks, "walks", blocks=rules, analysis="morris")
    monkeypatch.setitem(SAMPLERS, "walks", sampler)


JOINT = (
    "sweep: {joint: {sample: NAME, points: 9, separation_weight: {uniform: [0, 2]},"
    " cohesion_weight: {loguniform: [0.01, 1]}}}"
)


def sampled(name: str, *options: str) -> str:
    line = JOINT.replace("NAME", ", ".join([name, *options]))
    return short(
        "fixed: {n: 6, steps: 4}", line, "record: {metrics: [speed, dispersion]}"
    )


@pytest.mark.usefixtures("points_sampler")
def test_a_new_sampler_goes_through_every_command(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(sampled("middles"))
    assert "points     9" in commanded(tmp_path, "plan", "spec.yaml")
    assert "18 done" in commanded(tmp_path, "launch", "spec.yaml")
    assert "separation_weight" in commanded(tmp_path, "table", "short")
    drawn = commanded(tmp_path, "plot", "short", "--metric", "speed")
    for kind in ("scatter-speed", "parallel-speed", "sensitivity-speed"):
        assert kind in drawn
    study = StoredStudy("short", tmp_path / "results")
    weights = sorted(set(study.trials["separation_weight"]))
    np.testing.assert_allclose(weights, 2 * (np.arange(9) + 0.5) / 9)


@pytest.mark.usefixtures("points_sampler")
def test_specs_know_a_new_sampler(tmp_path: Path) -> None:
    said = refusal(sampled("midles"))
    assert 'did you mean "middles"?' in said
    assert ", middles, table" in said
    assert accepts(sampled("middles"))
    assert not accepts(sampled("midles"))
    assert not accepts(sampled("middles", "levels: 4"))
    assert "the middles of intervals" in json.dumps(json_schema())
    few = sampled("middles").replace("points: 9", "points: 7")
    (tmp_path / "spec.yaml").write_text(few)
    assert "joint: few points" in commanded(tmp_path, "plan", "spec.yaml")


@pytest.mark.usefixtures("walks_sampler")
def test_a_new_sampler_of_blocks_has_its_key_its_rules_and_its_analysis(
    tmp_path: Path,
) -> None:
    spec = sampled("walks", "stairs: 3")
    (tmp_path / "spec.yaml").write_text(spec)
    plan = commanded(tmp_path, "plan", "spec.yaml")
    assert "joint: 9 walks of 3 points each are 27 points" in plan
    assert "done" in commanded(tmp_path, "launch", "spec.yaml")
    drawn = commanded(tmp_path, "plot", "short", "sensitivity", "--metric", "speed")
    assert "sensitivity-speed.png" in drawn
    study = StoredStudy("short", tmp_path / "results")
    (axis,) = study.axes.values()
    assert "mu_star" in sensitivity(study, "speed")
    assert (axis.sampler, axis.size, axis.levels) == ("walks", 3, 6)
    assert accepts(spec)
    assert not accepts(spec.replace("stairs: 3", "stairs: 30"))
    assert not accepts(spec.replace("walks", "morris"))
    assert "stairs" in refusal(spec.replace("walks", "morris"))
    two = spec.replace("sweep: {", "sweep: {other: {sample: walks, points: 4, n: {")
    two = two.replace("n: {joint", "alignment_weight: {uniform: [0, 1]}}, joint")
    assert "one of saltelli or morris or walks" in refusal(two)


@pytest.mark.usefixtures("walks_sampler")
def test_the_stored_blocks_of_a_new_sampler_are_checked(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(sampled("walks"))
    commanded(tmp_path, "launch", "spec.yaml")
    wrong = SAMPLERS["walks"].blocks
    assert wrong
    with pytest.MonkeyPatch.context() as patch:
        rules = BlockRules("walks", (BlockSize(5, 5),), wrong.read, wrong.options)
        patch.setitem(SAMPLERS, "walks", Sampler(middles, "walks", blocks=rules))
        with pytest.raises(StoreError, match="no blocks of the size of a walks sample"):
            StoredStudy("short", tmp_path / "results")


def squared(unit: Unit, setting: Setting, arguments: Any) -> np.ndarray:
    """More often near the first of two numbers."""
    low, high = arguments
    setting.coerce(low)
    return np.asarray(low + unit**2 * (high - low))


@pytest.fixture
def distribution(monkeypatch: pytest.MonkeyPatch) -> None:
    entry = Distribution(squared, "More often near the first.", logarithmic=True)
    monkeypatch.setitem(DISTRIBUTIONS, "squared", entry)


@pytest.mark.usefixtures("distribution")
def test_a_new_distribution_is_drawn_from_alone_jointly_and_in_a_search(
    tmp_path: Path,
) -> None:
    alone = short("sweep: {separation_weight: {squared: [1, 2], points: 50}}")
    (column,) = parse_spec(alone).axes[0].columns.values()
    assert 1 <= column.min() < np.median(column) < 1.4
    joint = sampled("lhs").replace("uniform: [0, 2]", "squared: [1, 2]")
    assert min(parse_spec(joint).axes[0].columns["separation_weight"]) >= 1
    search = edited(TINY, ("{uniform: [0, 3]}", "{squared: [0.5, 3]}"))
    (tmp_path / "spec.yaml").write_text(search)
    commanded(tmp_path, "search", "spec.yaml")
    asked = read_asked(StoredStudy("tiny", tmp_path / "results"))
    assert asked.table["separation_weight"].between(0.5, 3).all()
    for spec in (alone, joint, search):
        assert accepts(spec)
        assert not accepts(spec.replace("squared", "sqared"))
        assert 'did you mean "squared"?' in refusal(spec.replace("squared", "sqared"))
    assert "More often near the first." in json.dumps(json_schema())


@pytest.mark.usefixtures("distribution")
def test_a_distribution_without_ends_suits_no_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(
        DISTRIBUTIONS, "squared", Distribution(squared, "Endless.", bounded=False)
    )
    search = edited(TINY, ("{uniform: [0, 3]}", "{squared: [0.5, 3]}"))
    assert '"separation_weight" cannot be squared' in refusal(search)
    assert not accepts(search)


def backwards(**options: Any) -> optuna.samplers.BaseSampler:
    """A sampler that somebody else has made."""
    assert options.pop("steps_back") == 2
    return optuna.samplers.RandomSampler(**options)


def steps_back(search: Sought) -> dict[str, Any]:
    return {"steps_back": len(search.parameters)}


@pytest.fixture
def search_sampler(monkeypatch: pytest.MonkeyPatch) -> None:
    small = Need(lambda search: search.batch < 9, "takes a batch of 8 at most")
    sampler = SearchSampler(backwards, "looks behind itself", steps_back, (small,))
    monkeypatch.setitem(SEARCH_SAMPLERS, "backwards", sampler)


BACKWARDS = edited(TINY, ("  batch: 4", "  batch: 4\n  sampler: backwards"))


@pytest.mark.usefixtures("search_sampler")
def test_a_new_sampler_of_a_search_goes_through_every_command(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(BACKWARDS)
    assert "search     backwards over" in commanded(tmp_path, "plan", "spec.yaml")
    found = commanded(tmp_path, "search", "spec.yaml")
    assert "sampler     backwards, batches of 4" in found
    asked = read_asked(StoredStudy("tiny", tmp_path / "results"))
    assert asked.description["sampler"] == "backwards"
    assert asked.description["options"] == {"steps_back": 2}


@pytest.mark.usefixtures("search_sampler")
def test_specs_know_a_new_sampler_of_a_search_and_what_it_needs() -> None:
    said = refusal(BACKWARDS.replace("backwards", "backward"))
    assert 'did you mean "backwards"?' in said
    assert accepts(BACKWARDS)
    assert not accepts(BACKWARDS.replace("backwards", "backward"))
    assert "looks behind itself" in json.dumps(json_schema())
    large = BACKWARDS.replace("batch: 4", "batch: 9")
    assert refusal(large).endswith("sampler backwards takes a batch of 8 at most")


def inner_mean(values: Floats, share: float, _maximize: bool) -> Floats:
    """The mean without that part of the values at either end."""
    ordered = np.sort(values, axis=-1)
    cut = int(share * values.shape[-1] / 2)
    return np.asarray(ordered[..., cut : values.shape[-1] - cut].mean(axis=-1))


def median(values: Floats, _share: float, _maximize: bool) -> Floats:
    """The median."""
    return np.asarray(np.median(values, axis=-1))


@pytest.fixture
def statistic(monkeypatch: pytest.MonkeyPatch) -> None:
    trimmed = StatisticKind(
        inner_mean,
        "the mean of what lies inside",
        takes_share=True,
        label="inner mean",
        tail=lambda share: share / 2,
    )
    monkeypatch.setitem(STATISTICS, "trimmed", trimmed)


MEDIAN = edited(
    TINY,
    ("minimize: mean", "minimize: median"),
    ("  batch: 4", "  batch: 4\n  constraints: {speed: {at_least: 0, STAT}}"),
    ("metrics: [flock_radius]", "metrics: [flock_radius, speed]"),
    ("replicates: 3}", "replicates: 12}"),
    ("replicates: 4", "replicates: 8"),
).replace("STAT", "statistic: median")


@pytest.fixture
def plain_statistic(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STATISTICS, "median", StatisticKind(median, "half are below"))


@pytest.mark.usefixtures("plain_statistic")
def test_a_new_statistic_goes_through_every_command(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(MEDIAN)
    assert "tpe over" in commanded(tmp_path, "plan", "spec.yaml")
    found = commanded(tmp_path, "search", "spec.yaml")
    assert "median flock_radius, to be small" in found
    assert "median speed at least 0" in found
    assert "history.png" in commanded(tmp_path, "plot", "tiny", "history")
    study = StoredStudy("tiny", tmp_path / "results")
    asked = read_asked(study)
    label = history_figure(study).axes[0].get_ylabel()
    assert label == "median of flock radius (px)\nless is better"
    one, bound = asked.description["objectives"][0], asked.description["constraints"][0]
    assert one["statistic"] == bound["statistic"] == "median"
    url = f"sqlite:///{tmp_path}/tiny.db"
    export(study, url)
    best = optuna.load_study(study_name="tiny", storage=url).best_trial
    rows = asked.table[
        (asked.table["candidate"] == best.user_attrs["candidate"])
        & (asked.table["run"] == "search")
        & (asked.table["phase"] == "search")
    ]
    assert best.value == pytest.approx(rows["flock_radius"].median())


@pytest.mark.usefixtures("plain_statistic")
def test_held_out_medians_have_intervals_and_no_reduction_of_variance(
    tmp_path: Path,
) -> None:
    (tmp_path / "spec.yaml").write_text(MEDIAN)
    found = json.loads(sweep(tmp_path, "search", "spec.yaml", "--json").stdout)
    (winner, *_) = found["winners"]
    assert winner["held_out_low"] < winner["held_out"] < winner["held_out_high"]
    assert winner["optimism"] is not None
    assert found["differences"][0]["variance_reduction"] is None


@pytest.mark.usefixtures("plain_statistic", "statistic")
def test_specs_know_a_new_statistic() -> None:
    assert 'did you mean "median"?' in refusal(MEDIAN.replace("median}", "medain}"))
    sharing = edited(TINY, ("minimize: mean", "minimize: {trimmed: 0.2}"))
    assert "trimmed needs a fraction, such as {trimmed: 0.1}" in refusal(
        sharing.replace("{trimmed: 0.2}", "trimmed")
    )
    both = sharing.replace("{trimmed: 0.2}", "{trimmed: 0.2, cvar: 0.1}")
    assert "needs cvar or trimmed, not both" in refusal(both)
    for spec in (MEDIAN, sharing):
        parse_spec(spec)
        assert accepts(spec)
    assert not accepts(sharing.replace("{trimmed: 0.2}", "trimmed"))
    assert not accepts(sharing.replace("0.2", "2"))
    schema = json.dumps(json_schema())
    assert "half are below" in schema
    assert "the mean of what lies inside" in schema


@pytest.mark.usefixtures("statistic")
def test_a_new_statistic_has_its_words_and_its_tail(tmp_path: Path) -> None:
    spec = edited(TINY, ("minimize: mean", "minimize: {trimmed: 0.2}"))
    spec = spec.replace("replicates: 3}", "replicates: 12}")
    (tmp_path / "spec.yaml").write_text(spec)
    found = commanded(tmp_path, "search", "spec.yaml")
    assert "inner mean 0.2 flock_radius, to be small" in found
    assert "use 100 held-out replicates" in found


def test_a_search_with_what_is_no_longer_entered_is_refused_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(STATISTICS, "median", StatisticKind(median, "half are below"))
    monkeypatch.setitem(DISTRIBUTIONS, "squared", Distribution(squared, "Squared."))
    spec = edited(
        TINY,
        ("minimize: mean", "minimize: median"),
        ("{uniform: [0, 3]}", "{squared: [0.5, 3]}"),
    )
    (tmp_path / "spec.yaml").write_text(spec)
    commanded(tmp_path, "search", "spec.yaml")
    for registry, name in ((STATISTICS, "median"), (DISTRIBUTIONS, "squared")):
        with pytest.MonkeyPatch.context() as patch:
            patch.delitem(registry, name)  # type: ignore[arg-type]
            done = sweep(tmp_path, "plot", "tiny", "history")
        assert (done.returncode, done.stdout) == (2, "")
        assert f'"{name}" here' in done.stderr
        assert done.stderr.count("\n") == 1


def plan_count(study: StoredStudy, choices: Choices) -> list[Planned]:
    """A bar with the number of trials; of a study that is large enough."""
    done = study.statuses().get("done", 0)
    if done < 2:
        raise ChoiceError("needs two trials, and there is one", study.name, "count")

    def draw(name: str) -> Figure:
        figure = Figure()
        figure.subplots().bar([name], [done])
        return figure

    return [Planned(name, partial(draw, name)) for name in choices.plain(study)]


@pytest.fixture
def figure_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    kind = FigureKind("how many trials there are", ("x",), plan_count)
    monkeypatch.setitem(KINDS, "count", kind)


@pytest.mark.usefixtures("figure_kind")
def test_a_new_kind_of_figure_goes_through_sweep_plot(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(sampled("lhs"))
    commanded(tmp_path, "launch", "spec.yaml")
    named = commanded(tmp_path, "plot", "short", "count", "--metric", "speed")
    assert named.endswith("count-speed.png\n")
    every = commanded(tmp_path, "plot", "short", "--metric", "speed")
    assert "count-speed.png" in every
    commanded(tmp_path, "plot", "short", "count", "--x", "separation_weight")
    wrong = sweep(tmp_path, "plot", "short", "cont")
    assert (wrong.returncode, 'did you mean "count"?' in wrong.stderr) == (2, True)
    taken = sweep(tmp_path, "plot", "short", "parallel", "--x", "separation_weight")
    kinds = "scatter, heatmap, scaling, collapse, count"
    assert f"x is for {kinds}, not for parallel" in taken.stderr
    assert "validity, scaling, collapse, sensitivity, count; of a search" in " ".join(
        re.sub("[^a-z,;]", " ", commanded(tmp_path, "plot", "--help")).split()
    )


@pytest.mark.usefixtures("figure_kind")
def test_why_a_new_kind_does_not_suit_is_said_once_with_others(tmp_path: Path) -> None:
    spec = sampled("lhs").replace("points: 9", "points: 1")
    (tmp_path / "spec.yaml").write_text(spec.replace("replicates: 2", "replicates: 1"))
    commanded(tmp_path, "launch", "spec.yaml")
    study = StoredStudy("short", tmp_path / "results")
    with pytest.raises(ChoiceError, match="study short: count needs two trials"):
        plan_figures(study, ["count"], Choices())
    with pytest.raises(ChoiceError, match="; count: needs two trials, and there is"):
        plan_figures(study, [], Choices())


def searched(spec: str, folder: Path) -> tuple[str, str]:
    """What a search of known trials has asked for and says, but for names."""
    with pytest.MonkeyPatch.context() as patch:
        replace_trials(patch, analytic())
        asked = asked_by(spec, folder)
    return asked.table.to_json(), as_text(
        search_report(StoredStudy("analytic", folder))
    )


SOUGHT = edited(
    ANALYTIC,
    ("budget: 200", "batch: 6\n  budget: 240\n  constraints:\n    coverage: {BOUND}"),
    ("replicates: 8", "replicates: 16"),
    ("replicates: 10}", "replicates: 8}\n  references: {known: {KNOWN}}"),
)
SOUGHT = SOUGHT.replace("KNOWN", ", ".join(f"{one}: {BEST[one]}" for one in BEST))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("mean", "mean"),
        ("worst", "worst"),
        ("quantile", "{quantile: 0.2}"),
        ("cvar", "{cvar: 0.3}"),
    ],
)
def test_a_statistic_under_another_name_races_and_judges_alike(
    name: str, written: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    about = STATISTICS[name]
    twin = replace(about, label=about.label or name)
    monkeypatch.setitem(STATISTICS, "twin", twin)
    spec = SOUGHT.replace("BOUND", f"at_least: -9, statistic: {written}")
    spec = edited(spec, ("maximize: mean", f"maximize: {written}"))
    other = spec.replace(written, written.replace(name, "twin"))
    assert other != spec
    found = searched(other, tmp_path / "twin")
    assert found == searched(spec, tmp_path / "own")
    assert "raced out" in found[1]


@pytest.mark.parametrize(
    "name", slow_but(["nsga2"], ["tpe", "nsga2", "random", "qmc", "cmaes"])
)
def test_a_sampler_of_a_search_under_another_name_asks_alike(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(SEARCH_SAMPLERS, "twin", SEARCH_SAMPLERS[name])
    asking = f"batch: 6\n  sampler: {name}\n  budget: 40"
    spec = edited(ANALYTIC, ("budget: 200", asking))
    own = searched(spec, tmp_path / "own")
    other = searched(spec.replace(f": {name}\n", ": twin\n"), tmp_path / "twin")
    assert other[0] == own[0]
    assert other[1] == own[1].replace(f"sampler     {name}", "sampler     twin")


def columns(spec: str) -> dict[str, list[float]]:
    """The points of the one axis of a spec."""
    (axis,) = parse_spec(spec).axes
    return {name: column.tolist() for name, column in axis.columns.items()}


@pytest.mark.parametrize("name", ["random", "lhs", "sobol", "saltelli", "morris"])
def test_a_sampler_of_points_under_another_name_draws_and_is_analysed_alike(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(SAMPLERS, "twin", SAMPLERS[name])
    assert columns(sampled("twin")) == columns(sampled(name))
    own, other = (
        sensitivity(study_of(joint_axis(one, 12)), "speed", resamples=9)
        for one in (name, "twin")
    )
    pd.testing.assert_frame_equal(other, own)


@pytest.mark.parametrize("name", ["uniform", "loguniform", "normal"])
def test_a_distribution_under_another_name_draws_and_is_drawn_alike(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(DISTRIBUTIONS, "twin", DISTRIBUTIONS[name])
    scales = []
    for one in (name, "twin"):
        sweep = joint_axis("morris", 9).replace("uniform: [0, 1]", f"{one}: [1, 2]")
        study = made_up(sweep)
        selection = select(study)
        scales.append(
            (
                selection.points[selection.sampled].to_numpy().tolist(),
                is_logarithmic(selection, selection.sampled[0]),
            )
        )
    assert scales[0] == scales[1]
    assert scales[0][1] == (name == "loguniform")
