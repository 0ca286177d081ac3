"""What a stranger's plan says of its study is what a spec could have said, or one
sentence says what is not.
"""

import math
import shutil
from pathlib import Path
from typing import Any

import pytest

from sweep.errors import StoreError
from sweep.tables.stored_study import StoredStudy
from tests.attacks.hostile import give_plan
from tests.commands import sweep
from tests.studies import SMALL, launched

RULE = {"metric": "speed", "half_width": 0.1, "confidence": 0.95, "min": 3, "max": 10}
RULE |= {"looks": [3], "nominal_confidence": 0.99}
WEIGHT = ["separation_weight"]


def until(**changes: Any) -> dict[str, Any]:
    return {"until": RULE | changes}


def axis(**about: Any) -> dict[str, Any]:
    return {
        "axes": {
            "x": {"fields": WEIGHT, "sampler": "saltelli", "size": 3, "levels": None}
            | about
        }
    }


PLANS: dict[str, tuple[dict[str, Any], str]] = {
    "metric unknown": (until(metric="evil"), 'unknown recorded metric "evil"'),
    "metrics unknown": (
        until(half_width={"speed": 0.1, "evil": "5%"}, metric=None),
        '"metric" must be a string',
    ),
    "half width a list": (until(half_width=[0.1]), '"half_width" must be a number'),
    "half width too many per cent": (
        until(half_width="900%"),
        "or a fraction of the mean, such as 5%",
    ),
    "metric a status": (until(metric="status"), 'unknown recorded metric "status"'),
    "half width NaN": (until(half_width=math.nan), "half_width"),
    "half width negative": (until(half_width=-1), "half_width"),
    "half width infinite": (until(half_width=math.inf), "half_width"),
    "confidence 2": (until(confidence=2), "confidence"),
    "nominal 2": (until(nominal_confidence=2), "nominal_confidence is 2"),
    "nominal NaN": (until(nominal_confidence=math.nan), "nominal_confidence is nan"),
    "min above max": (until(min=100), '"min" must be at most "max"'),
    "min -5": (until(min=-5), '"min" must be'),
    "max 2^62": (until(max=2**62), '"max" must be'),
    "max 10^400": (until(max=10**400), '"max" must be'),
    "ablated preset": ({"ablated": {"evil": [WEIGHT]}}, 'no preset "evil"'),
    "ablated setting": ({"ablated": {"as_written": [["evil"]]}}, 'no parameter "evil"'),
    "ablated status": (
        {"ablated": {"as_written": [["status"]]}},
        'no parameter "status"',
    ),
    "details of no axis": (
        {"ablated": {"real": [WEIGHT]}, "details": ["a"]},
        'no axis "real"',
    ),
    "details of nothing": ({"ablated": {}, "details": ["a"]}, "exactly one ablated"),
    "details of another number": (
        {"ablated": {"x": [WEIGHT]}, "details": ["a", "b"]} | axis(size=3),
        "1 components have 2 names",
    ),
    "detail twice": (
        {"ablated": {"x": [WEIGHT, WEIGHT]}, "details": ["a", "a"]} | axis(size=3),
        "a detail is listed twice",
    ),
    "detail with a sign": (
        {"ablated": {"x": [WEIGHT]}, "details": ["a+b"]} | axis(size=3),
        'no component can have the name "a.b"',
    ),
    "ablated group of none": (
        {"ablated": {"as_written": [[]]}},
        "ablates no parameter",
    ),
    "ablated none": ({"ablated": {"as_written": []}}, "ablates no parameter"),
    "model": ({"model": "evil"}, 'of "evil"'),
    "preset": ({"preset": "evil"}, 'no preset "evil"'),
    "varied id": ({"varied": ["trial_id"]}, 'no parameter "trial_id"'),
    "varied twice": ({"varied": WEIGHT * 2}, "a parameter is listed twice"),
    "a setting as a metric": ({"record": WEIGHT}, 'no metric "separation_weight"'),
    "metrics twice": ({"record": ["speed", "speed"]}, "a metric is listed twice"),
    "no metrics": ({"record": []}, "it records no metric"),
    "axis of ids": (axis(fields=["trial_id"]), 'no parameter "trial_id"'),
    "axis of nothing": (axis(fields=[]), "has no parameters"),
    "blocks without size": (
        axis(size=None),
        "no blocks of the size of a saltelli sample",
    ),
    "blocks of a negative size": (axis(size=-5), "no blocks of the size"),
    "blocks of 10^9": (axis(size=10**9), "no blocks of the size"),
    "rows a text": (axis(rows="x"), "no blocks of the size"),
    "rows negative": (axis(rows=[-1, 0, 1]), "no blocks of the size"),
    "rows not whole": (axis(rows=[0, 1]), "no blocks of the size"),
    "morris without levels": (axis(sampler="morris", size=2), "has no levels"),
    "morris of one level": (axis(sampler="morris", size=2, levels=1), "has no levels"),
}


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("honest")
    launched(SMALL, folder / "results")
    return folder


@pytest.fixture
def folder(honest: Path, tmp_path: Path) -> Path:
    shutil.copytree(honest, tmp_path, dirs_exist_ok=True)
    return tmp_path


@pytest.mark.parametrize("name", PLANS)
def test_a_plan_that_no_launch_writes_is_refused(folder: Path, name: str) -> None:
    about, message = PLANS[name]
    give_plan(folder / "results" / "small", about)
    said = f"study small: its plan is not what a launch writes: .*{message}"
    with pytest.raises(StoreError, match=said):
        StoredStudy("small", folder / "results")


@pytest.mark.parametrize("rows", [[0, 1, 10**9], [0, 1, 2], None])
def test_blocks_without_their_points_are_refused(
    folder: Path, rows: list[int] | None
) -> None:
    """The plan has two points, and a block of this sample three."""
    give_plan(folder / "results" / "small", axis(rows=rows) if rows else axis())
    done = sweep(folder, "plot", "small", "sensitivity")
    assert done.returncode == 2
    assert "the plan does not have the 2 points in whole blocks" in done.stderr
