"""Several goals on the page: in the scene, in the field of the setting, and drawn."""

import json
from pathlib import Path
from string import Template

import pytest
from ruamel.yaml import YAML

from sweep.errors import SpecError
from sweep.spec import places_of
from sweep.spec.study import parse_spec
from sweep.web import messages
from sweep.web.live_show import Live
from sweep.web.scene import scene_of
from sweep.web.state import begin, from_study
from tests import ROOT, builders
from tests.web.scripts import printed

STATIC = ROOT / "sweep/web/static"
SCRIPT = Template("""\
import { drawGoals } from "$static/ground.js";

function drawn(scene) {
  const [texts, circles] = [[], []];
  const context = new Proxy({}, {
    get: (_, name) => (...given) => {
      if (name === "fillText") texts.push(given[0]);
      if (name === "arc" && given[2] > 3) circles.push(given.slice(0, 3));
    },
    set: () => true,
  });
  const stage = {
    context,
    colours: { goal: "green" },
    camera: { scale: 2 },
    toScreen: ({ x, y }) => ({ x: 2 * x, y: 2 * y }),
  };
  drawGoals(stage, scene);
  return { texts: texts.filter((one) => one !== ""), circles };
}
console.log(JSON.stringify($scenes.map(drawn)));
""")


def scene(model: str = "aziel_chen2025", **changes: object) -> dict[str, object]:
    about = {"goal_x": 10, "goal_y": 20, "goal_radius": 30} | changes
    weight = {"goal_weight": 0.1} if model == "aziel_chen2025" else {}
    return scene_of(builders.job(model, **weight | about))


def test_all_goals_are_drawn_and_numbered_where_there_are_several(
    tmp_path: Path,
) -> None:
    """The screen has two pixels for a unit of length. (0, 0) alone is no goal, and
    nor is one that no boid seeks.
    """
    scenes = [
        scene(next_goals="40 50; 60 70"),
        scene(),
        scene(goal_x=0, goal_y=0),
        scene(goal_x=0, goal_y=0, next_goals="5 5"),
        scene("nguyen2024"),
        scene(goal_weight=0, next_goals="40 50"),
    ]
    assert [one["next_goals"] for one in scenes] == [
        [[40.0, 50.0], [60.0, 70.0]],
        [],
        [],
        [[5.0, 5.0]],
        [],
        [],
    ]
    script = SCRIPT.substitute(static=STATIC.as_uri(), scenes=json.dumps(scenes))
    several, one, none, from_corner, unsought, weightless = printed(script, tmp_path)
    assert several["texts"] == ["1", "2", "3"]
    assert several["circles"] == [[20, 40, 60], [80, 100, 60], [120, 140, 60]]
    assert (one["texts"], one["circles"]) == ([], [[20, 40, 60]])
    assert none == unsought == weightless == {"texts": [], "circles": []}
    assert (from_corner["texts"], len(from_corner["circles"])) == (["1", "2"], 2)


def test_the_field_of_goals_takes_the_text_that_tables_have() -> None:
    """A copied spec has them as its author would write them: as pairs."""
    state = begin("aziel_chen2025", "as_run")
    later = state.with_settings({"next_goals": "40 50;60.5 70"})
    assert later.settings["next_goals"] == "40 50; 60.5 70"
    again = from_study(parse_spec(later.as_text()))
    moved = again.with_settings({"next_goals": "1 2; 60.5 70"})
    for state in (later, again, moved):
        fixed = YAML(typ="safe").load(state.as_text())["fixed"]
        places = places_of(state.settings["next_goals"])
        assert fixed["next_goals"] == [list(place) for place in places or ()]
    assert "- [40, 50]" in later.as_text()
    assert "- [1, 2]" in moved.as_text()
    assert again.settings == later.settings
    with pytest.raises(SpecError, match="not allowed for next_goals; allowed: a list"):
        state.with_settings({"next_goals": "40 50 60"})


def test_a_goal_that_is_put_is_one_of_those_that_there_are() -> None:
    show = Live(begin("aziel_chen2025", "as_run"))
    show.handle(messages.Set("goal_weight", 0.1))
    show.handle(messages.Set("next_goals", "40 50;60 70"))
    for index, (x, y) in enumerate(((1.5, 2), (3, 4), (5, 6))):
        show.handle(messages.Goal(x, y, index))
    settings = show.state.settings
    assert (settings["goal_x"], settings["goal_y"]) == (1.5, 2)
    assert settings["next_goals"] == "3 4; 5 6"
    assert show.scene()["next_goals"] == [[3, 4], [5, 6]]
    with pytest.raises(SpecError, match="goal: index must be at most 2, not 3"):
        show.handle(messages.Goal(7, 8, 3))
    assert show.state.settings == settings


def test_a_model_that_knows_one_goal_is_refused_on_the_page_too() -> None:
    with pytest.raises(SpecError, match=r"nguyen2024 calls no `goal_of`"):
        begin("nguyen2024", "as_run").with_settings({"next_goals": "40 50"})
