"""How a study gives several goals, and what they need of it and of a model."""

from pathlib import Path

import pytest

from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.settings import MOST_PLACES, in_a_line, places_of
from sweep.spec.study import parse_spec
from sweep.trial.simulation import run
from tests.interpreter import interpreted

SPEC = """\
study: my/route
model: {model}
preset: as_written
fixed: {{n: 5, steps: 2, map: empty, width: 800, height: 600, next_goals: {goals}}}
replicates: 1
record: {{metrics: [goals_reached]}}
"""


def spec(goals: str, model: str = "aziel_chen2025") -> str:
    return SPEC.format(model=model, goals=goals)


@pytest.mark.parametrize(
    ("goals", "text"),
    [
        ("[[100, 200], [3.5, 0]]", "100 200; 3.5 0"),
        ("100 200; 3.50 -0", "100 200; 3.5 0"),
        ("'  100   2e2;3.5 0  '", "100 200; 3.5 0"),
        ("[[0.1, 1e-300]]", "0.1 1e-300"),
        ("[]", ""),
        ("''", ""),
    ],
)
def test_places_are_one_value_however_they_are_written(goals: str, text: str) -> None:
    """Of the same trial, whose table has the text."""
    study = parse_spec(spec(goals))
    assert study.fixed["next_goals"] == text
    assert in_a_line(places_of(text) or ()) == text
    other = parse_spec(spec(f"'{text}'"))
    jobs = [Jobs(one, expand(one)).at(0) for one in (study, other)]
    assert jobs[0].trial_id == jobs[1].trial_id


def test_routes_are_values_of_an_axis() -> None:
    """Each a list of places, or a text."""
    fixed = spec("[]").replace(", next_goals: []", "")
    text = fixed + 'sweep: {next_goals: [[], [[1, 2]], "1 2; 3 4"]}\n'
    design = expand(parse_spec(text))
    assert design.columns["next_goals"].tolist() == ["", "1 2", "1 2; 3 4"]


@pytest.mark.parametrize(
    "goals",
    [
        "[1, 2]",
        "[[1, 2, 3]]",
        "[[1, true]]",
        "[['1', '2']]",
        "[[.nan, 1]]",
        "[[.inf, 1]]",
        "1 2 3",
        "1 x",
        "1 2;",
        "5",
        str([[1, 2]] * (MOST_PLACES + 1)),
    ],
)
def test_what_is_no_list_of_places_is_refused(goals: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(spec(goals))
    said = str(error.value)
    assert said.startswith("spec.yaml:4: ")
    assert "for next_goals; allowed: a list of up to 100 positions" in said


def test_a_goal_outside_of_the_world_is_refused() -> None:
    with pytest.raises(SpecError) as error:
        expand(parse_spec(spec("[[1, 2], [801, 3]]")))
    assert (
        "spec.yaml:4: goal 3, at (801, 3) in next_goals, is outside the world"
        in str(error.value)
    )
    assert expand(parse_spec(spec("[[0, 600], [800, 0]]"))).n_points == 1


@pytest.mark.parametrize("model", ["nguyen2024", "strombom2014"])
def test_a_model_that_knows_one_goal_or_none_is_refused(model: str) -> None:
    """And told what would have to change; without further goals it flies."""
    text = spec("[[100, 200]]", model)
    with pytest.raises(SpecError) as error:
        expand(parse_spec(text))
    assert (
        f"spec.yaml:4: next_goals needs a model that goes to several goals, but {model}"
        " calls no `goal_of`" in str(error.value)
    )
    assert expand(parse_spec(spec("[]", model))).n_points == 1


SEEKS = {
    "from kernels.jit import jit\n": "from kernels.goals import goal_of\n",
    "            ax = robot.cohesion": (
        "            goal_x, goal_y = goal_of(world, work.goals, i)\n"
    ),
    "            vx, vy = limit(vx": (
        "            ax = 0.01 * (goal_x - flock.x[i])\n"
        "            ay = 0.01 * (goal_y - flock.y[i])\n"
    ),
}
"""What is written before these lines of a model."""


def test_a_model_of_ones_own_may_have_several_goals(tmp_path: Path) -> None:
    """Its boids reach one after the other."""
    text = Path("examples/vortex.py").read_text(encoding="utf-8")
    for old, new in SEEKS.items():
        assert text.count(old) == 1
        text = text.replace(old, new + old)
    (tmp_path / "vortex.py").write_text(text, encoding="utf-8")
    path = tmp_path / "spec.yaml"
    path.write_text(
        "study: my/a\nmodel: ./vortex.py\nreplicates: 1\nfixed:\n"
        "  {n: 4, steps: 400, goal_x: 50, goal_y: 50, goal_radius: 20,"
        " next_goals: [[150, 50]]}\nrecord: {metrics: [goals_reached]}\n",
        encoding="utf-8",
    )
    with pytest.raises(
        SpecError, match="=False: declare goals_in_turn=True in its Model; see"
    ):
        expand(load_spec(path))
    text = text.replace("goals_in_turn=False", "goals_in_turn=True")
    (tmp_path / "vortex.py").write_text(text, encoding="utf-8")
    code = (
        "from pathlib import Path\nfrom tests.design import test_goals as t\n"
        f"t.reaches_both(Path({str(path)!r}))"
    )
    interpreted(code)


def reaches_both(path: Path) -> None:
    """In the interpreter, since nobody else compiles that model."""
    study = load_spec(path)
    result = run(Jobs(study, expand(study)).at(0))
    assert result.last["goals_reached"] == 2.0
