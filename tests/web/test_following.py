"""What follows from other settings is no axis of its own on the page."""

import json
from pathlib import Path
from string import Template

import numpy as np

from sweep.spec.study import parse_spec
from sweep.web.controls import offered
from sweep.web.opened import opened
from sweep.web.state import begin, from_opened, from_study
from tests import ROOT
from tests.specs import short
from tests.web.scripts import printed

STATIC = ROOT / "sweep/web/static"
DISC = {"disc": {"x": 100.0, "y": 200.0, "radius": 30.0}}
SCRIPT = Template("""\
class Element {
  children = [];
  dataset = {};
  classList = { toggle() {} };
  constructor(tag) { this.tag = tag; }
  append(...children) { this.children.push(...children); }
  prepend(...children) { this.children.unshift(...children); }
  setAttribute(name, value) { this[name] = value; }
  addEventListener() {}
}
const make = (tag) => new Element(tag);
globalThis.document = { createElement: make, createElementNS: (_, tag) => make(tag) };

const { Pickers } = await import("$static/pickers.js");
const { Panels } = await import("$static/panels.js");

const tags = ({ tag, children = [] }) => [tag, ...children.flatMap(tags)];
const texts = ({ textContent = "", children = [] }) =>
  [textContent, ...children.flatMap(texts)].filter(Boolean);
const trials = new Pickers("test", () => {}).trials(...$trial);
const panels = new Panels(make("div"));
console.log(JSON.stringify({
  axes: trials.map((one) => [tags(one).includes("select"), texts(one).join(" ")]),
  panels: [...panels.toggles.keys()],
}));
""")


def follows(columns: dict[str, list[object]], drawn: tuple[str, ...] = ()) -> object:
    arrays = {name: np.array(values) for name, values in columns.items()}
    count = len(next(iter(arrays.values())))
    axes = offered("a/study", arrays, count, 1, drawn=drawn)["axes"]
    return {axis["name"]: axis["follows"] for axis in axes if axis["follows"]}


def test_a_column_that_an_earlier_one_decides_follows_from_it() -> None:
    grid = {"n": [5, 5, 20, 20], "noise": [0.1, 0.2, 0.1, 0.2]}
    sides = {name: [1.0, 1.0, 2.0, 2.0] for name in ("width", "height")}
    assert follows(grid) == {}
    assert follows(grid | sides) == {"width": "n", "height": "n"}
    maps = {"map": ["a", "b", "c"], "width": [1.0, 1.0, 2.0]}
    assert follows(maps) == {"width": "map"}
    assert follows({"width": maps["width"], "map": maps["map"]}) == {}


def test_each_parameter_of_a_small_sample_is_free() -> None:
    sample = {"noise": [0.1, 0.7, 0.4], "speed": [3.0, 1.0, 2.0]}
    assert follows(sample, drawn=("noise", "speed")) == {}
    assert follows(sample) == {"speed": "noise"}


def test_a_map_with_a_size_gives_width_and_height() -> None:
    state = begin("aziel_chen2025", "as_run")
    assert state.settings["map"] == "cafeteria"
    assert state.follows == {"width": ["map"], "height": ["map"]}
    assert state.place([DISC]).follows == {}
    assert state.with_settings({"map": "empty"}).follows == {}


def test_what_a_spec_derives_follows_until_it_is_changed() -> None:
    study = parse_spec(short("derive: {steps: 2 * n, start_margin: n}"))
    state = from_study(study)
    assert state.follows == {"steps": ["n"], "start_margin": ["n"]}
    assert state.with_settings({"steps": 5}).follows == {"start_margin": ["n"]}
    assert state.with_settings({"n": 4}).follows == {}
    assert from_opened(opened(study)).follows == state.follows


def test_a_picker_says_what_its_value_follows_from(tmp_path: Path) -> None:
    """And the panels are in the order of the screen."""
    trials = {
        "points": 2,
        "replicates": 1,
        "axes": [
            {"name": "n", "values": [5, 20], "follows": ""},
            {"name": "box_width", "values": [1.0, 2.0], "follows": "n"},
        ],
    }
    here = {
        "point": 0,
        "replicate": 0,
        "values": {"n": 5, "box_width": 1.5},
        "before": None,
        "after": None,
    }
    script = SCRIPT.substitute(static=STATIC.as_uri(), trial=json.dumps([trials, here]))
    answer = printed(script, tmp_path)
    n, width = answer["axes"]
    assert n[0]
    assert width == [False, "box width 1.5, follows from n"]
    assert answer["panels"] == ["watch", "settings"]
