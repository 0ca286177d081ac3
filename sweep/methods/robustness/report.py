"""The report of the conclusions of a study with different numerics."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from sweep.analysis import is_centred, plus_minus, with_interval
from sweep.methods.robustness.analysis import AS_IT_IS, OUTCOMES, UNJUDGED, Validity
from sweep.tables import MAX_ROWS, Report, TextTable, brief, json_rows
from sweep.text import so_many


def validity_report(validity: Validity) -> Report:
    """Return one row per conclusion, and the outcomes of all conclusions.

    A row has the difference in the study and in each variant. docs/json.md describes
    the keys of the JSON form.
    """
    conclusions = validity.conclusions
    per_conclusion = len(validity.variants) + 1
    cells = list[list[str]]()
    for number, (_, conclusion) in enumerate(conclusions.head(MAX_ROWS).iterrows()):
        start = per_conclusion * number
        differences = validity.rows.iloc[start : start + per_conclusion]
        cells.append(_cells(conclusion, differences, validity.settings))
    variants = [AS_IT_IS, *validity.variants.values()]
    table = TextTable(
        columns=["metric", *validity.settings, "against", *variants, "conclusion"],
        rows=cells,
        title=validity.study.name,
        ruled=False,
        hidden=max(len(conclusions) - MAX_ROWS, 0),
    )
    parts: list[TextTable | str] = [table, *_notes(validity), "", _summary(validity)]
    return Report(validity.rows, _facts(validity), parts)


def _facts(validity: Validity) -> dict[str, Any]:
    variants = [
        {
            "name": name,
            "words": description,
            "same_bits": validity.bits[name].same if name in validity.bits else None,
        }
        for name, description in validity.variants.items()
    ]
    return {
        "study": validity.study.name,
        "confidence": validity.confidence,
        "variants": variants,
        "conclusions": json_rows(validity.conclusions),
        "rows": json_rows(validity.rows),
    }


def _cells(
    conclusion: "pd.Series[Any]", differences: pd.DataFrame, settings: Sequence[str]
) -> list[str]:
    metric = str(conclusion["metric"])
    return [
        f"{metric} ({conclusion['unit']})" if conclusion["unit"] else metric,
        *(brief(conclusion[name]) for name in settings),
        conclusion["against"],
        *(_difference(row) for _, row in differences.iterrows()),
        conclusion["outcome"],
    ]


def _difference(row: "pd.Series[Any]") -> str:
    """Return a difference with its confidence interval in words; "-" if not judged."""
    if row["outcome"] == UNJUDGED:
        return "-"
    value, low, high = (float(row[name]) for name in ("difference", "low", "high"))
    half = (high - low) / 2.0
    if math.isnan(half) or is_centred(value, low, high):
        return plus_minus(value, half, sign=True)
    return with_interval(value, low, high, sign=True)


def _notes(validity: Validity) -> Iterator[str]:
    yield (
        "differences from the first point along an axis; simultaneous"
        f" {100 * validity.confidence:g} % confidence intervals (Bonferroni)"
    )
    for name, bits in validity.bits.items():
        yield (
            f"{validity.variants[name]}: {bits.same:,} of"
            f" {so_many(bits.trials, 'trial')} bitwise identical"
        )
    for name, missing in validity.missing.items():
        if missing:
            yield f"{name}: {so_many(missing, 'trial')} not stored"
    left = validity.rows[validity.rows["outcome"] == UNJUDGED]
    if len(left):
        metrics = ", ".join(left["metric"].unique())
        yield f"-: not judged, because the time step changes the meaning of: {metrics}"


def _summary(validity: Validity) -> str:
    outcomes = validity.conclusions["outcome"]
    counts = {name: int((outcomes == name).sum()) for name in OUTCOMES}
    text = ", ".join(f"{name} {count:,}" for name, count in counts.items() if count)
    return f"{so_many(len(outcomes), 'conclusion')}: {text}"
