"""A comparison in words, as `sweep compare` prints it: what is compared, a row for each
point and metric, how to read it, and a summary.
"""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import pandas as pd

from sweep.analysis.notation import (
    is_centred,
    number,
    percent,
    plus_minus,
    with_interval,
)
from sweep.methods.comparison.analysis import Comparison
from sweep.methods.comparison.matching import telling
from sweep.tables.means_text import brief
from sweep.tables.overview import few_skewed
from sweep.text import so_many

MOST_VALUES = 4
MOST_ALONE = 6
SMALLEST_P = 0.001

INTERVALS = {
    "holm": (
        "the intervals of all {n} hold together (Bonferroni),"
        " p is adjusted for all (Holm)"
    ),
    "bonferroni": (
        "the intervals of all {n} hold together and p is adjusted for all (Bonferroni)"
    ),
    "max_t": (
        "the intervals of all {n} hold together and p is adjusted for all (max t of"
        " resampled pairs)"
    ),
}
DISTRIBUTIONS = (
    "each metric has the intervals and the test of its distribution (sweep metrics);"
    " those of normal ones find too much where few skewed values meet narrow ones"
)
VERDICT = "B against A"
EFFECT = "g: Hedges' g, B - A in standard deviations of a trial"
REDUCTION = (
    "variance reduction: how many times as many independent trials would be needed"
)


def heading(comparison: Comparison) -> Iterable[str]:
    """What is compared with what, a line each."""
    matching = comparison.matching
    for letter, side in (("A", comparison.one), ("B", comparison.other)):
        missing = (
            f"; {side.missing:,} of its study are not stored" if side.missing else ""
        )
        points = (
            f"{so_many(side.trials['point'].nunique(), 'point')},"
            f" {so_many(len(side.trials), 'trial')}"
        )
        yield f"{letter}  {side.text}: {points}{missing}"
    differ = [
        f"{name} ({_some(one)}; {_some(other)})"
        for name, (one, other) in comparison.differ.items()
    ]
    yield f"A and B differ in {', '.join(differ) or 'no setting'}"
    on = (
        f" of A matched on {', '.join(matching.names)}"
        if matching.names
        else " of A with its partner"
    )
    yield f"{so_many(len(matching.settings), 'point')}{on}"
    if matching.same:
        yield f"{matching.same:,} more left out: both sides are the same trials"
    for letter, alone in zip("AB", matching.alone, strict=True):
        if len(alone):
            yield (
                f"without partner: {len(alone):,} of {letter}:"
                f" {_named(alone, matching.settings)}"
            )


def titles(comparison: Comparison) -> list[str]:
    """What stands above the columns of `cells`."""
    margin = comparison.method.margin
    return [
        "metric",
        *telling(comparison.matching.settings),
        *("A", "B", "B - A", "p", "g", "variance\nreduction", "trials"),
        *([f"p within\n±{margin:g}"] if margin is not None else []),
        VERDICT,
    ]


def cells(comparison: Comparison, rows: pd.DataFrame) -> list[list[str]]:
    """Some rows of a comparison, each as texts below its `titles`."""
    names = telling(comparison.matching.settings)
    return [_cells(row, names) for _, row in rows.iterrows()]


def _cells(row: "pd.Series[Any]", names: Sequence[str]) -> list[str]:
    within = [_chance(row["p_equivalent"])] if "p_equivalent" in row else []
    return [
        metric_named(row),
        *(brief(row[name]) for name in names),
        *_means(row),
        _chance(row["p"]),
        _short(row["hedges_g"]),
        _short(row["variance_reduction"]),
        _count(row),
        *within,
        row["verdict"],
    ]


def metric_named(row: "pd.Series[Any]") -> str:
    """The metric of a row, with its unit."""
    return f"{row['metric']} ({row['unit']})" if row["unit"] else str(row["metric"])


def notes(comparison: Comparison) -> Iterable[str]:
    """How to read the table, and warnings."""
    rows, method = comparison.rows, comparison.method
    width = f"half the width of the {100 * method.confidence:g} % interval"
    ends = "whose ends stand where it is not centred"
    yield f"±: {width}, {ends}; {together(comparison)}"
    if method.together != "max_t":
        yield DISTRIBUTIONS
    paired, streams = (
        int(rows["paired"].sum()),
        _listed(comparison.streams or ["one point"]),
    )
    yield f"{EFFECT}; {REDUCTION}" if paired else EFFECT
    if paired:
        number = (
            f"{paired:,} of {len(rows):,} rows are"
            if paired < len(rows)
            else "all rows are"
        )
        yield (
            f"{number} paired by seed and replicate,"
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
        number = (
            f"{lost['not_done_a']:,} of A and {lost['not_done_b']:,} of B are not done"
        )
        yield (
            f"in {so_many(int(short.sum()), 'row')} not all trials count: {number},"
            " others lack a value or a partner"
        )
    yield from _undefined(rows)
    counts = {
        str(name): [*part["n_a"], *part["n_b"]] for name, part in rows.groupby("metric")
    }
    yield from filter(None, [few_skewed(comparison.one.study, counts)])
    constant = rows["p"].isna() & (rows[["n_a", "n_b"]].min(axis=1) > 1)
    if constant.any():
        yield (
            f"no test in {so_many(int(constant.sum()), 'row')}: values of a side, or"
            " differences of pairs, are equal, or all but one, and do not show how much"
            " they vary; `low` and `high` of a metric would"
        )
    small = (
        (rows["p"] < 1.0 - method.confidence)
        & (rows["low"] <= 0.0)
        & (rows["high"] >= 0.0)
    )
    if small.any():
        yield (
            f"in {so_many(int(small.sum()), 'row')} p is small although the interval"
            " has 0: Holm's test sees more"
        )
    for letter, side in (("A", comparison.one), ("B", comparison.other)):
        if metrics := side.study.repeated:
            yield (
                f"{letter} has as many trials as {', '.join(metrics)} asked for: p and"
                " intervals are approximate"
            )


def summary(comparison: Comparison) -> Iterable[str]:
    """One line for each metric: at how many points B is higher, lower, and so on."""
    within = (
        f"±{comparison.method.margin:g}" if comparison.method.margin is not None else ""
    )
    words = {"equivalent": f"equivalent within {within}"}
    words |= {
        f"{one}, equivalent": f"{one} but equivalent within {within}"
        for one in ("higher", "lower")
    }
    for metric in dict.fromkeys(comparison.rows["metric"]):
        counts = comparison.verdicts(metric)
        (first, number), *others = [
            (words.get(verdict, verdict), number) for verdict, number in counts.items()
        ]
        points = so_many(len(comparison.matching.settings), "point")
        told = [
            f"{first} at {number:,} of {points}",
            *(f"{one} at {n:,}" for one, n in others),
        ]
        yield f"{metric}, {VERDICT}: {', '.join(told)}"


def together(comparison: Comparison) -> str:
    """How many comparisons there are, and how that was taken into account."""
    if comparison.tests == 1:
        return "p and interval are those of one comparison"
    return INTERVALS[comparison.method.together].format(n=f"{comparison.tests:,}")


def _some(values: list[Any]) -> str:
    shown = [brief(value)[:40] for value in values[:MOST_VALUES]]
    return ", ".join([*shown, *(["..."] if len(values) > MOST_VALUES else [])])


def _named(alone: pd.DataFrame, matched: pd.DataFrame) -> str:
    """The points without a partner. Each is named by the settings that vary on its
    side, without those that have the most common value.
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
    words = []
    for row in alone.head(MOST_ALONE).to_dict(orient="records"):
        told = [
            f"{name} = {brief(row[name])}"
            for name in fractions
            if name not in usual or row[name] != usual[name]
        ]
        words.append(", ".join(told))
    return "; ".join(
        [*words, *(["... (--json names all)"] if len(alone) > MOST_ALONE else [])]
    )


def _means(row: "pd.Series[Any]") -> tuple[str, str, str]:
    """A, B and their difference, all to the place that its interval allows."""
    a, b, low, high = (float(row[name]) for name in ("a", "b", "low", "high"))
    half, scale, value = (high - low) / 2, max(abs(a), abs(b)), float(row["difference"])
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
    """The metrics of which done trials have no value, and in what share of them."""
    for metric, part in rows.groupby("metric", sort=False):
        a, b = part["undefined_a"].mean(), part["undefined_b"].mean()
        if a > 0.0 or b > 0.0:
            of_a, of_b = (percent(one) if one else "0 %" for one in (a, b))
            yield (
                f"{metric} is undefined in {of_a} of the done trials of A and {of_b} of"
                " B: means are of the others"
            )


def _listed(names: Sequence[str]) -> str:
    """Names as a list in words, such as start, world and noise."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
