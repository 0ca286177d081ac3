"""The range that "sweep this" offers has the shown value as one of its points."""

import json
from pathlib import Path
from string import Template

import numpy as np

from kernels.models import MODELS
from sweep.web.controls import controls
from sweep.web.page import STATIC
from sweep.web.state import Range, _axis
from tests.web.scripts import printed

SCRIPT = Template("""
import { rangeAbout } from "$static/fields.js";
const asked = $asked;
console.log(JSON.stringify(
  asked.map(([value, low, high]) => rangeAbout(value, { low, high })),
));
""")
POINTS = 5


def test_the_shown_value_is_a_point_of_the_range_bit_for_bit(tmp_path: Path) -> None:
    """Of every slider of every preset, at the preset's value and at others."""
    rng = np.random.default_rng(4)
    asked, kinds = [], []
    for name, model in MODELS.items():
        for preset in model.presets:
            for group in controls(name, preset)["groups"]:
                for field in group["fields"]:
                    if field["slider"] is None or field["kind"] == "bool":
                        continue
                    low, high, _ = field["slider"]
                    drawn = rng.uniform(low, high, 3).tolist()
                    whole = field["kind"] == "int"
                    values = [field["default"], low, high, 2 * high, *drawn]
                    asked += [
                        (round(value) if whole else value, low, high)
                        for value in values
                    ]
                    kinds += [field["kind"]] * len(values)
    script = SCRIPT.substitute(static=STATIC.as_uri(), asked=json.dumps(asked))
    ranges = printed(script, tmp_path)
    middles = 0
    for (value, low, high), kind, found in zip(asked, kinds, ranges, strict=True):
        swept = Range(found["low"], found["high"], POINTS)
        axis = _axis(kind, swept)
        points = axis["values"] if kind == "int" else np.linspace(*axis["linspace"])
        assert value in list(points), (value, low, high, found)
        assert found["low"] < found["high"]
        assert min(low, value) <= found["low"]
        assert found["high"] <= max(high, value)
        middles += points[len(points) // 2] == value
    assert middles > len(asked) / 3
