"""The report of a comparison of side B with side A."""

import math
from typing import Any

import numpy as np

from sweep.methods.comparison.analysis import Comparison
from sweep.methods.comparison.matching import telling
from sweep.methods.comparison.sides import Side
from sweep.methods.comparison.words import (
    VERDICT,
    cells,
    heading,
    metric_named,
    notes,
    summary,
    titles,
    together,
)
from sweep.tables import MAX_ROWS, Report, TextTable


def comparison_report(comparison: Comparison) -> Report:
    """Return the two sides, a row per point and metric, notes and a summary."""
    parts: list[TextTable | str] = [
        *heading(comparison),
        _table(comparison),
        *notes(comparison),
        "",
        *summary(comparison),
    ]
    return Report(comparison.rows, comparison_facts(comparison), parts)


def _table(comparison: Comparison) -> TextTable:
    """Return the table. Each metric appears once, a single metric as the title."""
    rows = comparison.rows
    several = rows["metric"].nunique() > 1
    left = ("metric", *telling(comparison.matching.settings), VERDICT)
    columns = titles(comparison)[0 if several else 1 :]
    shown = list[list[str]]()
    sections = set[int]()
    last = ""
    for metric, *values in cells(comparison, rows.head(MAX_ROWS)):
        if several:
            if metric != last:
                sections.add(len(shown))
            shown.append([metric if metric != last else "", *values])
        else:
            shown.append(values)
        last = metric
    return TextTable(
        columns=columns,
        rows=shown,
        title="" if several else metric_named(rows.iloc[0]),
        right=[name for name in columns if name not in left],
        sections=sections,
        ruled=False,
        hidden=max(len(rows) - MAX_ROWS, 0),
    )


def comparison_facts(comparison: Comparison) -> dict[str, Any]:
    """Return the comparison as JSON values.

    Numbers have all their digits. NaN is None, and an infinite number "inf" or "-inf".
    """
    matching = comparison.matching
    method = comparison.method
    alone_a, alone_b = (table.to_dict(orient="records") for table in matching.alone)
    facts: dict[str, Any] = _plain(
        {
            "a": _side_facts(comparison.side_a, alone_a),
            "b": _side_facts(comparison.side_b, alone_b),
            "matched_on": matching.names,
            "points": len(matching.settings),
            "same_trials_left_out": matching.same,
            "differ": {
                name: {"a": values_a, "b": values_b}
                for name, (values_a, values_b) in comparison.differ.items()
            },
            "over": "half" if comparison.half else "last",
            "method": {
                "confidence": method.confidence,
                "together": method.together,
                "comparisons": comparison.tests,
                "interval": together(comparison),
                "margin": method.margin,
                "common_streams": list(comparison.streams),
            },
            "rows": comparison.rows.to_dict(orient="records"),
            "summary": list(summary(comparison)),
        }
    )
    return facts


def _side_facts(side: Side, alone: list[dict[Any, Any]]) -> dict[str, Any]:
    trials = side.trials
    return {
        "selection": side.text,
        "study": side.study.name,
        "model": side.model,
        "preset": trials["preset"].iloc[0],
        "kernels_sha": side.kernels,
        "points": int(trials["point"].nunique()),
        "trials": len(trials),
        "not_stored": side.missing,
        "without_partner": alone,
    }


def _plain(value: Any) -> Any:
    """Return a value without types of NumPy, and without numbers that JSON lacks."""
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(element) for element in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value
