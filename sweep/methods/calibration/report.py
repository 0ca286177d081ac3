"""The report of a calibrated study: misfit first, then estimates and their checks."""

import math
from collections.abc import Iterator
from typing import Any


from sweep.analysis import number, percent, with_interval
from sweep.methods.calibration.analysis import LEVELS, Posterior
from sweep.tables import Report, TextTable, brief, json_rows
from sweep.text import so_many

UNLIKELY = 0.05
"""Probability of the data below which the model is said not to fit."""
FEW = 100
"""Effective number of draws below which estimates are rough."""


def posterior_report(found: Posterior) -> Report:
    """Return the posterior: its CSV has a row per kept simulation, with its weight.

    docs/json.md describes the keys of the JSON form.
    """
    parts: list[TextTable | str] = [*_fit(found)]
    if not found.parameters.empty:
        parts.append(_parameters(found))
    if not found.choices.empty:
        parts.append(_choices(found))
    parts += [_predictive(found), _generations(found)]
    if not found.checks.empty:
        parts.append(_checks(found))
    return Report(found.draws, _facts(found), parts)


def _facts(found: Posterior) -> dict[str, Any]:
    tables = ("parameters", "choices", "predictive", "generations", "checks", "ranks")
    return {
        "study": found.study,
        "calibrate": found.rule.as_json(),
        "data_trials": found.data_trials,
        "finished": found.finished,
        "missing": found.missing,
        "simulations": found.simulations,
        "tolerance": found.tolerance,
        "effective": found.effective,
        "fit": None if math.isnan(found.fit) else found.fit,
        "checked": not found.checks.empty,
        **{name: json_rows(getattr(found, name)) for name in tables},
        "draws": json_rows(found.draws),
    }


def _fit(found: Posterior) -> Iterator[str]:
    """Yield lines on the distance of the data from what the model can do."""
    if not math.isnan(found.fit):
        far = f"{percent(found.fit)} of data sets from the prior are as far away"
        if found.fit < UNLIKELY:
            yield (
                f"misfit: only {far} from the simulations as the data:"
                " the model hardly produces such data, so the intervals mean little"
            )
        else:
            yield f"fit: {far} from the simulations as the data"
    for row in found.predictive.to_dict("records"):
        if not row["prior_low"] <= row["data"] <= row["prior_high"]:
            away = max(row["prior_low"] - row["data"], row["data"] - row["prior_high"])
            yield (
                f"misfit: the {row['summary']} of the data, {brief(row['data'])}, is"
                f" outside of all simulations of the prior, {brief(row['prior_low'])}"
                f" to {brief(row['prior_high'])}, by {away / row['spread']:.2g} spreads"
            )
        elif not row["low"] <= row["data"] <= row["high"]:
            yield (
                f"misfit: the {row['summary']} of the data, {brief(row['data'])}, is"
                " outside of 95 % of the kept simulations"
            )


def _title(found: Posterior) -> str:
    checked = "not checked" if found.checks.empty else "checked below"
    trials = so_many(found.data_trials, "trial")
    return f"{found.study}: posterior given {found.rule.to} ({trials}), {checked}"


def _parameters(found: Posterior) -> TextTable:
    rows = []
    for row in found.parameters.to_dict("records"):
        half = (row["high"] - row["low"]) / 2.0
        unit = f" ({row['unit']})" if row["unit"] else ""
        rows.append(
            [
                f"{row['parameter']}{unit}",
                number(row["mean"], half),
                number(row["sd"], half),
                number(row["median"], half),
                f"{number(row['low'], half)} to {number(row['high'], half)}",
                f"{brief(row['prior_low'])} to {brief(row['prior_high'])}",
            ]
        )
    return TextTable(
        columns=["parameter", "mean", "sd", "median", "95 % credible", "95 % of prior"],
        rows=rows,
        title=_title(found),
        caption="\n".join(_caption(found)),
    )


def _caption(found: Posterior) -> Iterator[str]:
    rule = found.rule
    yield (
        f"the {so_many(len(found.draws), 'nearest simulation')} of"
        f" {found.simulations:,}, as good as {found.effective:,.0f} independent draws;"
        f" tolerance {found.tolerance:.3g} spreads of the prior"
    )
    if found.effective < FEW:
        yield f"fewer than {FEW} independent draws: the estimates are rough"
    if found.data_trials != rule.replicates:
        yield (
            f"the data have {so_many(found.data_trials, 'trial')}, and a simulation has"
            f" {rule.replicates:,}: with equal numbers, the intervals are exact for"
            " the summaries"
        )
    if found.checks.empty:
        yield (
            "not checked: with checks: 100 under calibrate, synthetic data sets tell"
            " whether the intervals cover the truth"
        )
    if not found.finished:
        yield "not finished: launch the study again for further generations"
    if found.missing:
        yield f"{so_many(found.missing, 'trial')} of the plan are not stored"


def _choices(found: Posterior) -> TextTable:
    rows = [
        [
            str(row["parameter"]),
            brief(row["value"]),
            percent(row["prior"]),
            percent(row["posterior"]),
        ]
        for row in found.choices.to_dict("records")
    ]
    alone = found.parameters.empty
    return TextTable(
        columns=["parameter", "value", "prior", "posterior"],
        rows=rows,
        title=_title(found) if alone else "",
        caption="\n".join(_caption(found)) if alone else "",
    )


def _predictive(found: Posterior) -> TextTable:
    rows = []
    for row in found.predictive.to_dict("records"):
        half = (row["high"] - row["low"]) / 2.0
        rows.append(
            [
                str(row["summary"]),
                number(row["data"], half),
                with_interval(row["mean"], row["low"], row["high"]),
                f"{brief(row['prior_low'])} to {brief(row['prior_high'])}",
            ]
        )
    return TextTable(
        columns=["summary", "data", "posterior predictive", "range of prior"],
        rows=rows,
        caption="posterior predictive: mean and 95 % of the kept simulations",
    )


def _generations(found: Posterior) -> TextTable:
    rows = [
        [
            str(row["generation"]) if row["generation"] else "prior",
            f"{row['simulations']:,}",
            percent(row["accepted"]) if row["generation"] else "-",
            f"{row['tolerance']:.3g}",
            f"{row['effective']:,.0f}",
        ]
        for row in found.generations.to_dict("records")
    ]
    return TextTable(
        columns=["generation", "simulations", "accepted", "tolerance", "effective"],
        rows=rows,
        caption=(
            "accepted: nearer than the tolerance before; effective: independent draws"
            " that the kept simulations are worth"
        ),
    )


def _checks(found: Posterior) -> TextTable:
    rows = []
    for row in found.checks.to_dict("records"):
        cells = [str(row["parameter"]), f"{row['data_sets']:,}", _p(row["p"])]
        for level in LEVELS:
            name = f"coverage_{100 * level:g}"
            ends = row[f"{name}_low"], row[f"{name}_high"]
            cells.append(
                f"{percent(row[name])} ({percent(ends[0])} to {percent(ends[1])})"
            )
        rows.append(cells)
    titles = [f"{100 * level:g} % intervals cover" for level in LEVELS]
    return TextTable(
        columns=["parameter", "data sets", "uniform ranks, p", *titles],
        rows=rows,
        title="simulation-based calibration",
        caption="\n".join(_doubts(found)),
    )


def _p(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2g}"


def _doubts(found: Posterior) -> Iterator[str]:
    """Yield how to read the checks, and the parameters that fail."""
    yield (
        "synthetic data sets with known parameters went through the same calibration;"
        " coverage with 95 % confidence intervals"
    )
    tested = found.checks[found.checks["p"].notna()]
    level = UNLIKELY / max(1, len(tested))
    for row in tested.to_dict("records"):
        if row["p"] < level:
            yield (
                f"the ranks of {row['parameter']} are not uniform"
                f" (p = {row['p']:.2g}): do not trust its intervals"
            )
    if tested.empty:
        yield "too few data sets to test whether ranks are uniform"


def settled_in_words(found: Posterior) -> str:
    """Return the last generation in words, for `sweep status`."""
    last: dict[str, Any] = found.generations.iloc[-1].to_dict()
    state = "finished" if found.finished else "not finished"
    return (
        f"generation {last['generation']:.0f}, tolerance {last['tolerance']:.3g},"
        f" {last['effective']:,.0f} independent draws; {state}"
    )
