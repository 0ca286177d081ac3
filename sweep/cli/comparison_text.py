"""A comparison for a reader in a terminal, or as JSON for a program."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from rich.box import SIMPLE_HEAD
from rich.table import Table

from sweep.analysis.notation import (
    is_centred,
    number,
    percent,
    plus_minus,
    with_interval,
)
from sweep.cli.listing import MOST_ROWS
from sweep.cli.terminal import console
from sweep.tables.comparison import Comparison
from sweep.tables.comparison_sides import Side
from sweep.tables.matched_points import telling
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


def comparison_text(comparison: Comparison) -> None:
    """Print a comparison: what is compared, a row for each point and metric, how to
    read the table, and a summary.
    """
    out = console()
    for line in _heading(comparison):
        out.print(line, soft_wrap=True)
    out.print(_table(comparison))
    if len(comparison.rows) > MOST_ROWS:
        out.print(
            f"{len(comparison.rows) - MOST_ROWS:,} more rows: --csv and --json give all"
        )
    for line in (*_notes(comparison), "", *summary(comparison)):
        out.print(line, soft_wrap=True)


def comparison_json(comparison: Comparison) -> str:
    """The comparison as JSON. Numbers have all their digits. A missing one is null, an
    infinite one the text "inf".
    """
    matching, method = comparison.matching, comparison.method
    alone = [table.to_dict(orient="records") for table in matching.alone]
    about = {
        "a": _about(comparison.one, alone[0]),
        "b": _about(comparison.other, alone[1]),
        "matched_on": matching.names,
        "points": len(matching.settings),
        "same_trials_left_out": matching.same,
        "differ": {
            name: {"a": one, "b": other}
            for name, (one, other) in _differ(comparison).items()
        },
        "over": "half" if comparison.half else "last",
        "method": {
            "confidence": method.confidence,
            "together": method.together,
            "comparisons": comparison.tests,
            "interval": _together(comparison),
            "margin": method.margin,
            "common_streams": list(comparison.streams),
        },
        "rows": comparison.rows.to_dict(orient="records"),
        "summary": list(summary(comparison)),
    }
    return json.dumps(_plain(about), indent=2)


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


def _heading(comparison: Comparison) -> Iterable[str]:
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
        for name, (one, other) in _differ(comparison).items()
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


def _differ(comparison: Comparison) -> Mapping[str, tuple[list[Any], list[Any]]]:
    """The settings in which the sides differ. The number of steps between frames is one
    of them only for means over frames.
    """
    differ = comparison.matching.differ
    return {
        name: values
        for name, values in differ.items()
        if name != "every" or comparison.half
    }


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


def _table(comparison: Comparison) -> Table:
    rows, margin = comparison.rows, comparison.method.margin
    metrics = {
        metric: f"{metric} ({unit})" if unit else metric
        for metric, unit in zip(rows["metric"], rows["unit"], strict=True)
    }
    names = telling(comparison.matching.settings)
    several = len(metrics) > 1
    titles = [
        *(["metric"] if several else []),
        *names,
        "A",
        "B",
        "B - A",
        "p",
        "g",
        "variance\nreduction",
        "trials",
    ]
    titles += [f"p within\n±{margin:g}"] if margin is not None else []
    table = Table(
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title=None if several else next(iter(metrics.values())),
    )
    for title in (*titles, VERDICT):
        table.add_column(
            title, justify="left" if title in ("metric", *names, VERDICT) else "right"
        )
    last = ""
    for _, row in rows.head(MOST_ROWS).iterrows():
        if several and row["metric"] != last:
            table.add_section()
        metric = (
            [metrics[row["metric"]] if row["metric"] != last else ""] if several else []
        )
        last = row["metric"]
        equivalent = [_chance(row["p_equivalent"])] if margin is not None else []
        cells = [
            *metric,
            *(brief(row[name]) for name in names),
            *_means(row),
            _chance(row["p"]),
            _short(row["hedges_g"]),
        ]
        table.add_row(
            *cells,
            _short(row["variance_reduction"]),
            _count(row),
            *equivalent,
            row["verdict"],
        )
    return table


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


def _notes(comparison: Comparison) -> Iterable[str]:
    """How to read the table, and warnings."""
    rows, method = comparison.rows, comparison.method
    together = _together(comparison)
    width = f"half the width of the {100 * method.confidence:g} % interval"
    yield f"±: {width}, whose ends stand where it is not centred; {together}"
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


def _together(comparison: Comparison) -> str:
    """How many comparisons there are, and how that was taken into account."""
    if comparison.tests == 1:
        return "p and interval are those of one comparison"
    return INTERVALS[comparison.method.together].format(n=f"{comparison.tests:,}")


def _listed(names: Sequence[str]) -> str:
    """Names as a list in words, such as start, world and noise."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


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
