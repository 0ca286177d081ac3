"""A file of one's own whose boids have state and kinds: checked when it is loaded, run
by a spec, and described without its code.
"""

import json
import math
from pathlib import Path

import pytest
from matplotlib.colors import to_rgba

from kernels.model import Model, flaw
from kernels.settings import About
from sweep.errors import CodeError, SpecError
from sweep.figures import COLOURS, trajectories_figure
from sweep.own_code.description import described, description
from sweep.own_code.entries import Offered, nothing
from sweep.own_code.reading import named_model
from sweep.tables.stored_study import StoredStudy
from tests import ROOT
from tests.commands import sweep
from tests.oscillators import MODEL, ORDER, SPEC
from tests.plotted import legend_texts

TEXT = (
    (ROOT / "tests" / "oscillators.py").read_text()
    + """
METRICS = {"order": ORDER}
"""
)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"phase": About', '"vy": About', 'no state can be called "vy": tables have'),
        ('"phase": About', '"coupling": About', "there is a setting of that name"),
        ("    count_kinds=count_kinds,\n", "", "kinds and count_kinds belong together"),
    ],
)
def test_a_state_or_kinds_that_cannot_be_are_refused(
    tmp_path: Path, old: str, new: str, said: str
) -> None:
    path = tmp_path / "circles.py"
    path.write_text(TEXT)
    name, known = named_model(str(path))
    assert list(known.models[name].state) == ["phase", "frequency"]
    path.write_text(TEXT.replace(old, new))
    with pytest.raises(SpecError) as raised:
        named_model(str(path))
    assert "circles.py: oscillators: " in str(raised.value)
    assert said in str(raised.value)


@pytest.mark.slow
def test_a_study_of_it_runs_and_its_trajectories_are_exported(tmp_path: Path) -> None:
    (tmp_path / "circles.py").write_text(TEXT)
    spec = SPEC.replace("model: oscillators", "model: ./circles.py")
    (tmp_path / "spec.yaml").write_text(spec.replace("[order]", "[./circles.py]", 1))
    launched = sweep(tmp_path, "launch", "spec.yaml")
    assert "4 done" in launched.stderr
    verified = sweep(tmp_path, "verify", "circles", "--fraction", "1")
    assert "4 of 4 bitwise identical" in verified.stdout
    sweep(tmp_path, "export", "circles", "--table", "trajectories", "--to", "t.csv")
    names = "trial_id,frame,boid,x,y,vx,vy,phase,frequency,kind"
    first = (tmp_path / "t.csv").read_text().partition("\n")[0]
    assert first.replace('"', "") == names


def offering(model: Model) -> Offered:
    """What a file offers that has the model, and the metric."""
    return nothing()._replace(models={model.name: model}, metrics={"order": ORDER})


def test_a_description_has_state_and_kinds_without_code() -> None:
    own = offering(MODEL)
    found = described(json.dumps(description(own)))
    model, metric = found.models[MODEL.name], found.metrics["order"]
    assert (model.state, model.kinds) == (MODEL.state, MODEL.kinds)
    assert (metric.state, metric.kinds) == (ORDER.state, ORDER.kinds)
    assert model.count_kinds is not None
    with pytest.raises(CodeError, match="but was not loaded"):
        model.count_kinds(None, 3)


def test_a_description_says_how_values_are_distributed() -> None:
    """One that was stored before metrics said so has the default, and no other word."""
    own = offering(MODEL)
    own.metrics["order"] = ORDER._replace(distribution="count")
    about = description(own)
    assert described(json.dumps(about)).metrics["order"].distribution == "count"
    del about["metrics"]["order"]["distribution"]
    assert described(json.dumps(about)).metrics["order"].distribution is None
    about["metrics"]["order"]["distribution"] = "rare"
    with pytest.raises(ValueError, match="distribution='rare'"):
        described(json.dumps(about))


def test_a_description_says_what_values_lie_in() -> None:
    """One that was stored before metrics said so has values anywhere."""
    own = offering(MODEL)
    own.metrics["order"] = ORDER._replace(low=0.0, high=1.0)
    about = json.loads(json.dumps(description(own)))
    assert described(json.dumps(about)).metrics["order"].high == 1.0
    del about["metrics"]["order"]["high"]
    assert described(json.dumps(about)).metrics["order"].high == math.inf
    for wrong in ("1", None, -1.0, math.nan):
        about["metrics"]["order"]["high"] = wrong
        with pytest.raises(ValueError, match=r"low=0\.0 and high="):
            described(json.dumps(about))


def test_a_description_of_a_state_that_cannot_be_is_none() -> None:
    """It may be a stranger's."""
    bad = MODEL._replace(state={"vx": About("a column", "radians")})
    text = json.dumps(description(offering(bad)))
    with pytest.raises(ValueError, match='no state can be called "vx"'):
        described(text)


@pytest.mark.slow
def test_in_a_figure_of_its_flights_each_kind_has_a_colour(tmp_path: Path) -> None:
    """Three of twelve boids are pacemakers, which come first. The seventh frame is the
    last: six steps a boid lead to it.
    """
    (tmp_path / "circles.py").write_text(TEXT)
    spec = SPEC.replace("model: oscillators", "model: ./circles.py")
    (tmp_path / "spec.yaml").write_text(spec.replace("[order]", "[./circles.py]", 1))
    sweep(tmp_path, "launch", "spec.yaml", "--workers", "1")
    study = StoredStudy("circles", tmp_path / "results")
    figure = trajectories_figure(study)
    assert legend_texts(figure) == ["pacemaker", "follower"]
    pacemaker, follower = map(to_rgba, COLOURS[:2])
    marks = figure.legends[0].legend_handles
    assert [to_rgba(mark.get_color()) for mark in marks] == [pacemaker, follower]
    for axes in figure.axes:
        _, trails, flock = axes.collections
        colours = list(map(tuple, flock.get_facecolor()))
        assert colours == 3 * [pacemaker] + 9 * [follower]
        ways = [colour[:3] for colour in map(tuple, trails.get_colors())]
        assert ways[-12:] == [colour[:3] for colour in colours]
        assert ways[:12] == ways[-12:]


def test_what_models_of_earlier_versions_say_of_threads_harms_nothing() -> None:
    """`at_once` in a file, and in what is stored of one."""
    earlier = MODEL._replace(at_once={"update": "synchronous"})
    assert flaw(earlier) == ""
    about = json.dumps(description(offering(earlier)))
    assert described(about).models[MODEL.name].at_once == earlier.at_once
