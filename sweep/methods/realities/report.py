"""The report of the reality gap: drops, rank changes and their imperfections."""

import math
from collections.abc import Iterator
from typing import Any

import pandas as pd

from sweep.analysis import Interval, is_centred, number, plus_minus, with_interval
from sweep.methods.realities.analysis import (
    ControllerGap,
    RankChange,
    RealityGap,
)
from sweep.methods.realities.estimates import TENTH
from sweep.tables import MAX_ROWS, Report, TextTable, json_rows
from sweep.text import so_many

FEW_IN_TENTH = 20
"""Number of realities in the worst tenth for an interval with about its confidence."""


def gap_report(gap: RealityGap) -> Report:
    """Return the scores and drops of controllers, rank changes of pairs, and indices.

    docs/json.md describes each key.
    """
    study = gap.study
    unit = study.units.get(gap.metric, "")
    parts: list[TextTable | str] = [_controllers(gap, unit)]
    if gap.pairs:
        parts.append(_pairs(gap, unit))
    parts.append(_imperfections(gap))
    facts = {
        "study": study.name,
        "metric": gap.metric,
        "unit": unit,
        "better": gap.better,
        "confidence": gap.confidence,
        "draws": gap.draws,
        "repeated": gap.repeated,
        "trials_without_value": gap.scores.without_value,
        "controllers": [_controller_facts(each) for each in gap.controllers],
        "pairs": [_pair_facts(each) for each in gap.pairs],
    }
    return Report(_rows(gap), facts, parts)


def _controllers(gap: RealityGap, unit: str) -> TextTable:
    return TextTable(
        columns=["controller", "design", "realities", "drop", "worst tenth", "verdict"],
        rows=[
            [
                each.controller,
                _written(each.design),
                _written(each.realities),
                _written(each.drop, sign=True),
                _written(each.worst_tenth),
                each.verdict,
            ]
            for each in gap.controllers[:MAX_ROWS]
        ],
        title=f"{gap.study.name}: {gap.metric}{f' ({unit})' if unit else ''}",
        caption="\n".join(_notes(gap)),
        hidden=max(len(gap.controllers) - MAX_ROWS, 0),
        row_name="controller",
    )


def _notes(gap: RealityGap) -> Iterator[str]:
    level = f"{100 * gap.confidence:g} %"
    yield (
        f"{gap.draws:,} realities, common to all controllers; {gap.better} values are"
        " better"
    )
    if gap.repeated:
        yield (
            f"{so_many(gap.repeated, 'draw')} left out: equal to the design world or an"
            " earlier draw; each different reality counts once, at any frequency"
        )
    yield (
        f"drop: from the design world to the mean of the realities; simultaneous"
        f" {level} confidence intervals (Bonferroni, with the advantages of pairs)"
    )
    yield (
        f"worst tenth: mean of the worst tenth of the realities (CVaR), {level}"
        " confidence intervals over realities and replicates"
    )
    enough = round(FEW_IN_TENTH / TENTH)
    if gap.draws < enough:
        yield (
            f"intervals of the worst tenth are too narrow for fewer than {enough}"
            " realities"
        )
    if left_out := gap.scores.without_value:
        yield f"{so_many(left_out, 'trial')} without a value left out"


def _pairs(gap: RealityGap, unit: str) -> TextTable:
    head = f"advantage{f' ({unit})' if unit else ''}"
    return TextTable(
        columns=[
            "better in design",
            "than",
            f"{head}\nin design",
            f"{head}\nover realities",
            "probability of\nrank change",
            "rank",
        ],
        rows=[
            [
                each.leader,
                each.other,
                _written(each.design, sign=True),
                _written(each.realities, sign=True),
                _written(each.change),
                each.verdict,
            ]
            for each in gap.pairs[:MAX_ROWS]
        ],
        caption=(
            "probability of rank change: fraction of realities in which the second"
            f" controller is better, {100 * gap.confidence:g} % confidence intervals"
            " over realities and replicates; replicate noise counts"
        ),
        hidden=max(len(gap.pairs) - MAX_ROWS, 0),
        row_name="pair",
    )


def _imperfections(gap: RealityGap) -> TextTable:
    rows = list[list[str]]()
    sections = list[int]()
    for each in gap.controllers[:MAX_ROWS]:
        sections.append(len(rows))
        for row in each.indices.table.to_dict("records"):
            rows.append(
                [
                    each.controller,
                    str(row["parameter"]),
                    *(
                        with_interval(
                            row[name], row[f"{name}_low"], row[f"{name}_high"]
                        )
                        for name in ("first", "total")
                    ),
                    number(round(each.indices.predicted, 2)),
                ]
            )
    is_clean = all(each.indices.without_noise for each in gap.controllers)
    noise = "without replicate noise" if is_clean else "replicate noise included"
    caption = (
        "first: fraction of the variance over realities that the imperfection explains"
        " alone\n"
        f"total: with all interactions (Sobol indices, {noise})\n"
        "predicted: fraction that the surrogate predicts at left-out draws"
    )
    reasons = {each.controller: each.indices.reason for each in gap.controllers}
    if len({*reasons.values()}) == 1:
        reasons = {"-": gap.controllers[0].indices.reason}
    for name, reason in [*reasons.items()][:MAX_ROWS]:
        caption += f"\n{name}: {reason}" if reason else ""
    return TextTable(
        columns=["controller", "imperfection", "first", "total", "predicted"],
        rows=rows,
        caption=caption,
        sections=sections,
        hidden=max(len(gap.controllers) - MAX_ROWS, 0),
        row_name="controller",
    )


def _written(interval: Interval, *, sign: bool = False) -> str:
    value, low, high, _ = interval
    half = (high - low) / 2.0
    if math.isnan(half) or is_centred(value, low, high):
        return plus_minus(value, half, sign=sign)
    return with_interval(value, low, high, sign=sign)


def _rows(gap: RealityGap) -> pd.DataFrame:
    """Return one row per finding."""
    rows: list[dict[str, object]] = []
    for gap_of_one in gap.controllers:
        where = {"controller": gap_of_one.controller, "other": "", "imperfection": ""}
        for name in ("design", "realities", "drop", "worst_tenth"):
            verdict = gap_of_one.verdict if name == "drop" else ""
            rows.append(_row(name, where, getattr(gap_of_one, name), verdict))
        n = gap.draws
        for line in gap_of_one.indices.table.to_dict("records"):
            for name in ("first", "total"):
                ends = (line[name], line[f"{name}_low"], line[f"{name}_high"])
                place = where | {"imperfection": line["parameter"]}
                rows.append(_row(name, place, Interval(*ends, n), ""))
    for pair in gap.pairs:
        where = {"controller": pair.leader, "other": pair.other, "imperfection": ""}
        for name, interval in (
            ("advantage_in_design", pair.design),
            ("advantage_over_realities", pair.realities),
            ("rank_change", pair.change),
        ):
            verdict = pair.verdict if name == "rank_change" else ""
            rows.append(_row(name, where, interval, verdict))
    return pd.DataFrame(rows)


def _row(
    name: str, where: dict[str, str], interval: Interval, verdict: str
) -> dict[str, object]:
    return {"quantity": name, **where, **interval._asdict(), "verdict": verdict}


def _interval_facts(interval: Interval) -> dict[str, Any]:
    (facts,) = json_rows(pd.DataFrame([interval._asdict()]))
    return facts


def _controller_facts(gap: ControllerGap) -> dict[str, Any]:
    intervals = ("design", "realities", "drop", "worst_tenth")
    (quality,) = json_rows(pd.DataFrame([{"predicted": gap.indices.predicted}]))
    return {
        "controller": gap.controller,
        **{name: _interval_facts(getattr(gap, name)) for name in intervals},
        "verdict": gap.verdict,
        "indices": json_rows(gap.indices.table),
        "degree": gap.indices.degree,
        "without_noise": gap.indices.without_noise,
        "reason": gap.indices.reason,
        **quality,
    }


def _pair_facts(pair: RankChange) -> dict[str, Any]:
    intervals = ("design", "realities", "change")
    return {
        "leader": pair.leader,
        "other": pair.other,
        **{name: _interval_facts(getattr(pair, name)) for name in intervals},
        "verdict": pair.verdict,
    }
