"""The report of other numerics: what they make of the conclusions of a study."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from sweep.analysis.notation import is_centred, plus_minus, with_interval
from sweep.methods.robustness.analysis import AS_IT_IS, OUTCOMES, UNJUDGED, Validity
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.reports import MAX_ROWS, Report, TextTable
from sweep.text import so_many


def validity_report(found: Validity) -> Report:
    """Return a row for each conclusion, with its difference in the study and in each
    variant, and what all of them say together; docs/json.md says what each key is.
    """
    conclusions = found.conclusions
    per_conclusion = len(found.variants) + 1
    cells = list[list[str]]()
    for number, (_, conclusion) in enumerate(conclusions.head(MAX_ROWS).iterrows()):
        start = per_conclusion * number
        differences = found.rows.iloc[start : start + per_conclusion]
        cells.append(_cells(conclusion, differences, found.settings))
    variants = [AS_IT_IS, *found.variants.values()]
    table = TextTable(
        columns=["metric", *found.settings, "against", *variants, "conclusion"],
        rows=cells,
        title=found.study.name,
        ruled=False,
        hidden=max(len(conclusions) - MAX_ROWS, 0),
    )
    parts: list[TextTable | str] = [table, *_notes(found), "", _summary(found)]
    return Report(found.rows, _facts(found), parts)


def _facts(found: Validity) -> dict[str, Any]:
    variants = [
        {
            "name": name,
            "words": words,
            "same_bits": found.bits[name].same if name in found.bits else None,
        }
        for name, words in found.variants.items()
    ]
    return {
        "study": found.study.name,
        "confidence": found.confidence,
        "variants": variants,
        "conclusions": json_rows(found.conclusions),
        "rows": json_rows(found.rows),
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
    """A difference with its interval; a dash where it is not judged."""
    if row["outcome"] == UNJUDGED:
        return "-"
    value, low, high = (float(row[name]) for name in ("difference", "low", "high"))
    half = (high - low) / 2.0
    if math.isnan(half) or is_centred(value, low, high):
        return plus_minus(value, half, sign=True)
    return with_interval(value, low, high, sign=True)


def _notes(found: Validity) -> Iterator[str]:
    yield (
        "differences of each point to the first one along an axis; all intervals hold"
        f" together with {100 * found.confidence:g} % (Bonferroni)"
    )
    for name, bits in found.bits.items():
        yield (
            f"{found.variants[name]}: {bits.same:,} of {so_many(bits.trials, 'trial')}"
            " have the same bits"
        )
    for name, missing in found.missing.items():
        if missing:
            yield f"{name}: {so_many(missing, 'trial')} not stored"
    left = found.rows[found.rows["outcome"] == UNJUDGED]
    if len(left):
        metrics = ", ".join(left["metric"].unique())
        yield f"-: not judged, as another step changes what it measures: {metrics}"


def _summary(found: Validity) -> str:
    outcomes = found.conclusions["outcome"]
    counts = {name: int((outcomes == name).sum()) for name in OUTCOMES}
    said = ", ".join(f"{name} {count:,}" for name, count in counts.items() if count)
    return f"{so_many(len(outcomes), 'conclusion')}: {said}"
