"""A model, a metric and a map are entered in one place each, and say all that is known
of them. That nobody else knows any of them by name is a rule of tests/house/names.py.
"""

import json
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np
import pytest

from examples import vortex
from kernels.catalogue import BUILT_IN
from kernels.jit import jit
from kernels.metrics import METRICS, Metric
from kernels.metrics.ground import Better
from kernels.model import Sight
from kernels.models import MODELS
from kernels.recording import Frames
from kernels.settings import UNITS, Demand, Observation
from kernels.worlds import MAPS, Map
from sweep.design.cost import trial_seconds
from sweep.figures.directions import direction
from sweep.spec.schema import json_schema
from sweep.spec.settings import GROUPS, preset_settings, settings_of
from sweep.spec.study import RecordSpec
from sweep.tables.stored_study import StoredStudy
from sweep.testing import assert_keeps
from sweep.trial.simulation import run
from sweep.trial.world import world_of
from sweep.web.history import Cursor
from sweep.web.live_show import Live
from sweep.web.state import begin
from tests import builders
from tests.commands import sweep
from tests.house.names import known_by_name


def faults(names: Iterable[str], check: Callable[[str], None]) -> dict[str, str]:
    """What is wrong with each of the entries, for all that fail a check."""
    found = {}
    for name in names:
        try:
            check(name)
        except AssertionError as error:
            found[name] = str(error)
    return found


def check_model(name: str) -> None:
    model = MODELS[name]
    assert model.name == name
    assert {"as_written", "as_run"} <= set(model.presets)
    assert set(model.metrics) <= set(METRICS)
    assert model.source


def check_settings(model: str) -> None:
    assert_keeps(model, "settings")
    assert_keeps(model, "presets")


def check_weights(model: str) -> None:
    rules = {rule.weight: rule.name for rule in MODELS[model].rules}
    weights = [
        name for name in settings_of(model, BUILT_IN) if name.endswith("_weight")
    ]
    assert list(rules) == weights
    assert [rules[name] + "_weight" for name in weights] == weights


def check_metric(name: str) -> None:
    metric = METRICS[name]
    assert metric.text
    assert metric.source
    assert metric.unit in UNITS
    assert metric.better in get_args(Better)


def check_map(name: str) -> None:
    assert MAPS[name].text
    assert MAPS[name].source


def test_a_model_is_entered_under_its_name_with_both_presets_and_known_metrics() -> (
    None
):
    assert MODELS
    assert faults(MODELS, check_model) == {}


def test_a_model_says_all_of_its_settings_and_gives_them_values() -> None:
    assert faults(MODELS, check_settings) == {}


def test_a_weight_is_called_by_its_rule() -> None:
    assert faults(MODELS, check_weights) == {}


def test_a_metric_has_a_text_a_source_and_a_unit_or_none() -> None:
    assert METRICS
    assert faults(METRICS, check_metric) == {}


def test_a_map_has_a_text_and_a_source() -> None:
    assert MAPS
    assert faults(MAPS, check_map) == {}


def test_a_setting_that_all_models_have_has_a_text_and_a_unit_and_one_group() -> None:
    for _, group in GROUPS:
        for hint in get_type_hints(group, include_extras=True).values():
            assert get_args(hint)[1].text
            assert get_args(hint)[1].unit in UNITS
    names = [name for _, group in GROUPS for name in group._fields]
    assert len(names) == len(set(names))


def test_names_are_words() -> None:
    """So that whoever looks for words in texts finds them."""
    assert all(re.fullmatch(r"\w+", name) for name in known_by_name())


@jit
def eastward(
    frames: Frames,
    filled: int,
    _ground: Any,
    _observation: Observation,
    values: np.ndarray,
) -> None:
    """Mean x component of the velocity: a metric nobody has entered."""
    for f in range(filled):
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            total += frames.bodies[f, 2, i]
        values[f] = total / frames.bodies.shape[2]


def pillar(settings: Any, _rng: np.random.Generator) -> np.ndarray:
    """One disc in the middle of the world: a map nobody has entered."""
    return np.array([[settings.width / 2, settings.height / 2, 40.0, 40.0, 1.0]])


def ahead(params: Any) -> Sight:
    """Whom the boids of a new model see."""
    return Sight(params.perception_range, 270.0)


@pytest.fixture
def entered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A model, a metric and a map, each with one entry of its dict."""
    robots = vortex.MODEL._replace(
        length="m",
        time="s",
        y_down=False,
        sight=ahead,
        demands=(Demand("perception_range > 0", "the boids are blind"),),
    )
    metric = Metric(
        eastward,
        unit="length/time",
        text="mean velocity along x",
        source="this test",
        better="low",
        pairwise=True,
        demands=(Demand("n > 1", "one boid has no mean"),),
    )
    monkeypatch.setitem(MODELS, "vortex", robots)
    monkeypatch.setitem(METRICS, "eastward", metric)
    monkeypatch.setitem(MAPS, "pillar", Map(pillar, "one disc", "this test"))
    settings_of.cache_clear()
    yield
    settings_of.cache_clear()


@pytest.mark.usefixtures("entered")
@pytest.mark.parametrize("preset", vortex.MODEL.presets)
def test_a_new_model_metric_and_map_run_with_one_entry_each(preset: str) -> None:
    a_job = builders.job(
        "vortex",
        preset,
        map="pillar",
        metrics=("eastward", "speed"),
        series=("eastward",),
        steps=30,
    )
    result = run(a_job)
    assert result.status == "done", result.error
    assert abs(result.last["eastward"]) <= result.last["speed"] <= 5.0
    assert len(result.series["eastward"]) == 31
    world = world_of(a_job)
    assert (world.obstacles.shape, world.y_down, world.goal) == ((1, 5), False, None)


SPEC = """
study: new
model: vortex
preset: standard
fixed: {map: pillar, n: 12, steps: 10}
sweep: {cohesion_weight: [0.01, 0.1]}
replicates: 2
seed: 5
record:
  metrics: [eastward, coverage]
  series: [eastward]
  every: 5
  trajectories: true
"""


@pytest.mark.usefixtures("entered")
def test_every_command_knows_them(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SPEC)
    for words, said in (
        (["models"], "vortex"),
        (["models", "vortex"], "cohesion_weight"),
        (["metrics"], "eastward"),
        (["maps"], "pillar"),
        (["plan", "spec.yaml"], "vortex, preset standard"),
        (["launch", "spec.yaml"], "4 done"),
        (["table", "new"], "eastward"),
        (["plot", "new"], "pareto"),
    ):
        done = sweep(tmp_path, *words)
        assert done.returncode == 0, (words, done.stderr)
        assert said in done.stdout + done.stderr, words
    study = StoredStudy("new", tmp_path / "results")
    assert study.statuses() == {"done": 4}
    assert study.units["eastward"] == "m/s"
    assert not direction(study, "eastward").high


@pytest.mark.usefixtures("entered")
@pytest.mark.parametrize(
    ("setting", "message"),
    [("perception_range: 0", "the boids are blind"), ("n: 1", "one boid has no mean")],
)
def test_what_they_demand_is_checked(
    tmp_path: Path, setting: str, message: str
) -> None:
    spec = SPEC.replace("n: 12", setting)
    (tmp_path / "spec.yaml").write_text(spec)
    done = sweep(tmp_path, "plan", "spec.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"spec.yaml:5: {message}")


@pytest.mark.usefixtures("entered")
def test_a_metric_that_compares_pairs_costs_more() -> None:
    settings = preset_settings("vortex", "standard", BUILT_IN)
    compared, plain = (
        trial_seconds("vortex", BUILT_IN, settings, RecordSpec((name,)))
        for name in ("eastward", "speed")
    )
    assert compared > plain


@pytest.mark.usefixtures("entered")
def test_the_schema_and_the_page_know_them() -> None:
    schema = json.dumps(json_schema())
    assert all(f'"{name}"' in schema for name in ("vortex", "eastward", "pillar"))
    state = begin("vortex", "standard").with_settings({"map": "pillar", "n": 12})
    show = Live(state.follow(("eastward",)))
    controls, scene, status = show.greeting()
    assert controls["model"] == status["model"] == "vortex"
    assert "eastward" in {metric["name"] for metric in controls["metrics"]}
    assert "pillar" in {one["name"] for one in controls["maps"]}
    assert (scene["length"], scene["downwards"], scene["goal"]) == ("m", False, None)
    show.draw(("accelerations", "coverage", "flocks"))
    show.select(3)
    show.take_steps(2)
    show.advance(2)
    assert show.picture()
    replies = {reply["type"]: reply for reply in show.news(Cursor())[0]}
    assert replies["rules"]["names"] == ["cohesion", "swirl"]
    assert replies["selection"]["fov"] == 270.0
    assert len(replies["metrics"]["values"]["eastward"]) == 3
