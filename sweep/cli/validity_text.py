"""What variants make of the conclusions of a study, for a reader in a terminal or for a
program.
"""

import json
import math
from collections.abc import Iterator
from typing import Any

import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.table import Table

from sweep.analysis.notation import is_centred, plus_minus, with_interval
from sweep.cli.listing import MOST_ROWS
from sweep.cli.terminal import console
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.validity import AS_IT_IS, OUTCOMES, UNJUDGED, Validity
from sweep.text import so_many


def validity_json(found: Validity) -> str:
    """All that is known; docs/json.md says what each key is."""
    variants = [
        {
            "name": name,
            "words": words,
            "same_bits": found.bits[name].same if name in found.bits else None,
        }
        for name, words in found.variants.items()
    ]
    return json.dumps(
        {
            "study": found.study.name,
            "confidence": found.confidence,
            "variants": variants,
            "conclusions": json_rows(found.conclusions),
            "rows": json_rows(found.rows),
        },
        indent=2,
    )


def validity_text(found: Validity) -> None:
    """Print a row for each conclusion, with its difference in the study and in each
    variant, and what all of them say together.
    """
    conclusions, per = found.conclusions, len(found.variants) + 1
    titles = [AS_IT_IS, *found.variants.values()]
    table = Table(
        *("metric", *found.settings, "against", *titles, "conclusion"),
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title=found.study.name,
    )
    for number, (_, one) in enumerate(conclusions.head(MOST_ROWS).iterrows()):
        rows = found.rows.iloc[per * number : per * (number + 1)]
        table.add_row(
            f"{one['metric']} ({one['unit']})" if one["unit"] else one["metric"],
            *(brief(one[name]) for name in found.settings),
            one["against"],
            *(_difference(row) for _, row in rows.iterrows()),
            one["outcome"],
        )
    out = console()
    out.print(table)
    if (more := len(conclusions) - MOST_ROWS) > 0:
        out.print(f"{more:,} more rows: --csv and --json give all")
    for line in (*_notes(found), "", _summary(found)):
        out.print(line, soft_wrap=True)


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
