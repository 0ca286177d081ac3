"""Stores that earlier versions wrote, and what those versions said of them."""

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.tables.stored_spec import LATER
from sweep.tables.stored_study import StoredStudy
from tests import ROOT

STORED = ROOT / "tests" / "stored"
VALUES = {"b": "true".__eq__, "i": int, "f": lambda text: float(text or "nan")}
"""What a text in a CSV file stands for, by the kind of its column."""


def columns_of(file: Path) -> dict[str, list[str]]:
    """The columns of a table as that version exported it."""
    rows = list(csv.DictReader(file.read_text().splitlines()))
    return {name: [row[name] for row in rows] for name in rows[0]}


def long(study: StoredStudy, table: str) -> pd.DataFrame:
    """A table with one row a pixel or boid, as CSV files have it."""
    frame = getattr(study, table)
    if table == "heatmaps":
        pixels = [
            (trial, *place, count)
            for trial, visits in zip(frame["trial_id"], frame["visits"], strict=True)
            for place, count in np.ndenumerate(visits)
        ]
        return pd.DataFrame(pixels, columns=["trial_id", "row", "column", "visits"])
    if table == "trajectories":
        names = ["x", "y", "vx", "vy"]
        boids = frame.explode(names, ignore_index=True)
        number = boids.groupby(["trial_id", "frame"], sort=False).cumcount()
        return boids.astype(dict.fromkeys(names, float)).assign(boid=number)
    return frame


def equal(frame: pd.DataFrame, columns: dict[str, list[str]]) -> None:
    """Assert that a table has the values of an exported one, to the last bit, and none
    for settings that came later.
    """
    later = set(frame.columns) - set(columns)
    assert later <= set(LATER)
    assert frame[[*later]].isna().all(axis=None)
    assert set(columns) <= set(frame.columns)
    for name, texts in columns.items():
        if pd.api.types.is_string_dtype(frame[name]):
            frame = frame.assign(**{name: frame[name].fillna("")})
        value = VALUES.get(frame[name].dtype.kind, str)
        then = np.array([value(text) for text in texts])
        np.testing.assert_array_equal(frame[name].to_numpy(then.dtype), then, name)


def leaves(value: Any, place: str = "") -> dict[str, Any]:
    """What stands in nested lists and mappings, by its place."""
    if not isinstance(value, dict | list):
        return {place: value}
    parts = value.items() if isinstance(value, dict) else enumerate(value)
    nested = (leaves(part, f"{place}/{name}") for name, part in parts)
    return {key: leaf for inner in nested for key, leaf in inner.items()}


def alike(now: str, then: str, *, but: str = "(?!)", new: str = "(?!)") -> None:
    """Assert that two JSON texts say the same, but for the rounding of numbers.

    `but` are places that may say something else, `new` those that there were not then.
    """
    found, wanted = (
        {
            place: value
            for place, value in leaves(json.loads(text)).items()
            if not re.search(but, place)
        }
        for text in (now, then)
    )
    assert {place for place in found if not re.search(new, place)} == wanted.keys()
    for place, value in wanted.items():
        end = re.sub("(low|high)$", "{}", place)
        ends = (wanted.get(end.format("low")), wanted.get(end.format("high")))
        if "{}" in end and ends[0] == ends[1]:
            continue  # a constant sample was a certainty then
        known = pytest.approx(value, rel=1e-9) if isinstance(value, float) else value
        assert found[place] == known, place
