"""A comparison in words, in the form that `sweep compare` prints.

The two sides come first. Then follow a row per point and metric, notes on how to read
the table, and a summary.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import pandas as pd

from sweep.analysis import (
    is_centred,
    number,
    percent,
    plus_minus,
    with_interval,
)
from sweep.methods.comparison.analysis import Comparison
from sweep.methods.comparison.matching import telling
from sweep.tables import brief, few_skewed
from sweep.text import so_many

MOST_VALUES = 4
MOST_ALONE = 6
SMALLEST_P = 0.001

INTERVALS = {
    "holm": (
        "all {n} confidence intervals are simultaneous (Bonferroni),"
        " p is adjusted for all (Holm)"
    ),
    "bonferroni": (
        "all {n} confidence intervals are simultaneous and p is adjusted for all"
        " (Bonferroni)"
    ),
    "max_t": (
        "all {n} confidence intervals are simultaneous and p is adjusted for all (max t"
        " of resampled pairs)"
    ),
}
DISTRIBUTIONS = (
    "intervals and tests follow the distribution of each metric (sweep metrics); with"
    " normal metrics, few skewed values against narrow values give false positives"
)
VERDICT = "B against A"
EFFECT = "g: Hedges' g, B - A in standard deviations of a trial"
REDUCTION = "variance reduction: independent trials would need this many times as many"


def heading(comparison: Comparison) -> Iterable[str]:
    """Yield the lines above the table: sides, differences and the matching."""
    matching = comparison.matching
    for letter, side in (("A", comparison.side_a), ("B", comparison.side_b)):
        missing = (
            f"; {side.missing:,} of the study are not stored" if side.missing else ""
        )
        points = (
            f"{so_many(side.trials['point'].nunique(), 'point')},"
            f" {so_many(len(side.trials), 'trial')}"
        )
        yield f"{letter}  {side.text}: {points}{missing}"
    differ = [
        f"{name} ({_some(values_a)}; {_some(values_b)})"
        for name, (values_a, values_b) in comparison.differ.items()
    ]
    yield f"A and B differ in {', '.join(differ) or 'no parameter'}"
    if units := comparison.other_units:
        metrics = [f"{name} ({a}; {b})" for name, (a, b) in units.items()]
        yield f"not compared, as units differ: {', '.join(metrics)}"
    on = (
        f" of A matched on {', '.join(matching.names)}"
        if matching.names
        else " of A with a partner"
    )
    yield f"{so_many(len(matching.settings), 'point')}{on}"
    if matching.same:
        yield f"{matching.same:,} more left out: the two sides are identical trials"
    for letter, alone in zip("AB", matching.alone, strict=True):
        if len(alone):
            yield (
                f"without partner: {len(alone):,} of {letter}:"
                f" {_named(alone, matching.settings)}"
            )


def titles(comparison: Comparison) -> list[str]:
    """Return the titles of the columns of `cells`."""
    margin = comparison.method.margin
    return [
        "metric",
        *telling(comparison.matching.settings),
        *("A", "B", "B - A", "p", "g", "variance\nreduction", "trials"),
        *([f"p within\n±{margin:g}"] if margin is not None else []),
        VERDICT,
    ]


def cells(comparison: Comparison, rows: pd.DataFrame) -> list[list[str]]:
    """Return the strings of some rows of a comparison, below its `titles`."""
    settings = telling(comparison.matching.settings)
    return [_cells(row, settings) for _, row in rows.iterrows()]


def _cells(row: "pd.Series[Any]", settings: Sequence[str]) -> list[str]:
    within = [_chance(row["p_equivalent"])] if "p_equivalent" in row else []
    return [
        metric_named(row),
        *(brief(row[name]) for name in settings),
        *_means(row),
        _chance(row["p"]),
        _short(row["hedges_g"]),
        _short(row["variance_reduction"]),
        _count(row),
        *within,
        row["verdict"],
    ]


def metric_named(row: "pd.Series[Any]") -> str:
    """Return the metric of a row, with its unit."""
    return f"{row['metric']} ({row['unit']})" if row["unit"] else str(row["metric"])


def notes(comparison: Comparison) -> Iterable[str]:
    """Yield notes on how to read the table, and warnings."""
    rows = comparison.rows
    method = comparison.method
    width = f"half-width of the {100 * method.confidence:g} % confidence interval"
    ends = "or the bounds of an interval that is not centred"
    yield f"±: {width}, {ends}; {together(comparison)}"
    if method.together != "max_t":
        yield DISTRIBUTIONS
    paired = int(rows["paired"].sum())
    streams = _listed(comparison.streams or ["one point"])
    yield f"{EFFECT}; {REDUCTION}" if paired else EFFECT
    if paired:
        count = (
            f"{paired:,} of {len(rows):,} rows are"
            if paired < len(rows)
            else "all rows are"
        )
        yield (
            f"{count} paired by seed and replicate,"
            f" with the random numbers of {streams} in common"
        )
    else:
        yield "not paired: the trials of A and B share no random numbers"
    if (
        short := (rows["n_a"] < rows["trials_a"]) | (rows["n_b"] < rows["trials_b"])
    ).any():
        lost = rows[rows["metric"] == rows["metric"].iloc[0]][
            ["not_done_a", "not_done_b"]
        ].sum()
        count = (
            f"{lost['not_done_a']:,} of A and {lost['not_done_b']:,} of B are not done"
        )
        yield (
            f"in {so_many(int(short.sum()), 'row')} not all trials count: {count},"
            " further trials lack a value or a partner"
        )
    yield from _undefined(rows)
    counts = {
        str(name): [*part["n_a"], *part["n_b"]] for name, part in rows.groupby("metric")
    }
    yield from filter(None, [few_skewed(comparison.side_a.study, counts)])
    constant = rows["p"].isna() & (rows[["n_a", "n_b"]].min(axis=1) > 1)
    if constant.any():
        yield (
            f"no test in {so_many(int(constant.sum()), 'row')}: values of a side, or"
            " differences of pairs, are all equal, or all but one, so the spread is"
            " unknown; declare `low` and `high` of the metric"
        )
    small = (
        (rows["p"] < 1.0 - method.confidence)
        & (rows["low"] <= 0.0)
        & (rows["high"] >= 0.0)
    )
    if small.any():
        yield (
            f"in {so_many(int(small.sum()), 'row')} p is small although the interval"
            " includes 0: Holm's test has more power"
        )
    for letter, side in (("A", comparison.side_a), ("B", comparison.side_b)):
        if metrics := side.study.repeated:
            yield (
                f"the number of trials of {letter} depends on {', '.join(metrics)}: p"
                " and intervals are approximate"
            )


def summary(comparison: Comparison) -> Iterable[str]:
    """Yield one line per metric, with the number of points of each verdict."""
    within = (
        f"±{comparison.method.margin:g}" if comparison.method.margin is not None else ""
    )
    labels = {"equivalent": f"equivalent within {within}"}
    labels |= {
        f"{verdict}, equivalent": f"{verdict} but equivalent within {within}"
        for verdict in ("higher", "lower")
    }
    for metric in dict.fromkeys(comparison.rows["metric"]):
        counts = comparison.verdicts(metric)
        (first, count), *further = [
            (labels.get(verdict, verdict), count) for verdict, count in counts.items()
        ]
        points = so_many(len(comparison.matching.settings), "point")
        parts = [
            f"{first} at {count:,} of {points}",
            *(f"{verdict} at {n:,}" for verdict, n in further),
        ]
        yield f"{metric}, {VERDICT}: {', '.join(parts)}"


def together(comparison: Comparison) -> str:
    """Return the number of comparisons and the correction for it, in words."""
    if comparison.tests == 1:
        return "p and interval are for a single comparison"
    return INTERVALS[comparison.method.together].format(n=f"{comparison.tests:,}")


def _some(values: list[Any]) -> str:
    shown = [brief(value)[:40] for value in values[:MOST_VALUES]]
    return ", ".join([*shown, *(["..."] if len(values) > MOST_VALUES else [])])


def _named(alone: pd.DataFrame, matched: pd.DataFrame) -> str:
    """Return the points without a partner in words.

    Each point is named by the parameters that vary on its side, without parameters that
    have the value of more than half of the points.
    """
    points = pd.concat([matched, alone])
    fractions = {
        name: points[name].value_counts(normalize=True) for name in telling(points)
    }
    usual = {
        name: fraction.index[0]
        for name, fraction in fractions.items()
        if fraction.iloc[0] > 0.5
    }
    phrases = []
    for row in alone.head(MOST_ALONE).to_dict(orient="records"):
        unusual = [
            f"{name} = {brief(row[name])}"
            for name in fractions
            if name not in usual or row[name] != usual[name]
        ]
        phrases.append(", ".join(unusual))
    return "; ".join(
        [*phrases, *(["... (--json lists all)"] if len(alone) > MOST_ALONE else [])]
    )


def _means(row: "pd.Series[Any]") -> tuple[str, str, str]:
    """Return A, B and the difference, with the digits that the interval allows."""
    a, b, low, high = (float(row[name]) for name in ("a", "b", "low", "high"))
    half = (high - low) / 2
    scale = max(abs(a), abs(b))
    value = float(row["difference"])
    difference = (
        plus_minus(value, half, scale, sign=True)
        if math.isnan(half) or is_centred(value, low, high)
        else with_interval(value, low, high, scale, sign=True)
    )
    return number(a, half), number(b, half), difference


def _chance(p: float) -> str:
    if math.isnan(p):
        return "-"
    return f"{p:.3f}" if p >= SMALLEST_P else f"<{SMALLEST_P:g}"


def _short(number: float) -> str:
    return "-" if math.isnan(number) else f"{number:.3g}"


def _count(row: "pd.Series[Any]") -> str:
    return f"{row['n_a']}" if row["paired"] else f"{row['n_a']}, {row['n_b']}"


def _undefined(rows: pd.DataFrame) -> Iterable[str]:
    """Yield a line per metric that done trials lack, with fractions of trials."""
    for metric, part in rows.groupby("metric", sort=False):
        a = part["undefined_a"].mean()
        b = part["undefined_b"].mean()
        if a > 0.0 or b > 0.0:
            of_a, of_b = (percent(share) if share else "0 %" for share in (a, b))
            yield (
                f"{metric} is undefined in {of_a} of the done trials of A and {of_b} of"
                " B: means use the remaining trials"
            )


def _listed(names: Sequence[str]) -> str:
    """Return names as a list in words, such as start, world and noise."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
