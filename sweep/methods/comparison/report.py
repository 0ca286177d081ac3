"""The report of a comparison: what B has more or less than A."""

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
from sweep.tables.reports import MAX_ROWS, Report, TextTable


def comparison_report(comparison: Comparison) -> Report:
    """Return what is compared, a row for each point and metric, how to read the table,
    and a summary.
    """
    parts: list[TextTable | str] = [
        *heading(comparison),
        _table(comparison),
        *notes(comparison),
        "",
        *summary(comparison),
    ]
    return Report(comparison.rows, comparison_facts(comparison), parts)


def _table(comparison: Comparison) -> TextTable:
    """The metric stands once above its rows, as the title where there is one only."""
    rows = comparison.rows
    several = rows["metric"].nunique() > 1
    left = ("metric", *telling(comparison.matching.settings), VERDICT)
    columns = titles(comparison)[0 if several else 1 :]
    shown = list[list[str]]()
    sections = set[int]()
    last = ""
    for metric, *others in cells(comparison, rows.head(MAX_ROWS)):
        if several:
            if metric != last:
                sections.add(len(shown))
            shown.append([metric if metric != last else "", *others])
        else:
            shown.append(others)
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
    """The comparison as values that JSON has. Numbers have all their digits. A missing
    one is None, an infinite one the text "inf".
    """
    matching, method = comparison.matching, comparison.method
    alone = [table.to_dict(orient="records") for table in matching.alone]
    facts: dict[str, Any] = _plain(
        {
            "a": _about(comparison.one, alone[0]),
            "b": _about(comparison.other, alone[1]),
            "matched_on": matching.names,
            "points": len(matching.settings),
            "same_trials_left_out": matching.same,
            "differ": {
                name: {"a": one, "b": other}
                for name, (one, other) in comparison.differ.items()
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


def _about(side: Side, alone: list[dict[Any, Any]]) -> dict[str, Any]:
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
    """`value` without the types of NumPy, and without numbers that JSON does
    not have.
    """
    if isinstance(value, dict):
        return {str(key): _plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value
