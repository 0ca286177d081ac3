"""The reports of calibrated studies: misfit first, then estimates and their checks."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from sweep.analysis import number, percent, with_interval
from sweep.methods.calibration.analysis import (
    END,
    FEWEST_COMPARED,
    LEVELS,
    Posterior,
)
from sweep.methods.calibration.model_odds import Odds
from sweep.tables import Report, TextTable, brief, json_rows
from sweep.text import so_many

UNLIKELY = 0.05
"""Probability of the data below which the report warns of a misfit."""
PILED_UP = 0.2
"""Posterior probability of an end of the prior above which the report warns."""
FEW = 100
"""Effective number of draws below which estimates are rough."""


def posterior_report(outcome: Posterior, *, every: bool = False) -> Report:
    """Return the posterior: its CSV has a row per kept simulation, with its weight.

    docs/json.md describes the keys of the JSON form.

    Parameters
    ----------
    outcome : Posterior
    every : bool, default False
        Whether the CSV has all simulations for the data, without weights.
    """
    parts: list[TextTable | str] = [*_fit(outcome)]
    if not outcome.parameters.empty:
        parts.append(_parameters(outcome))
    if not outcome.choices.empty:
        parts.append(_choices(outcome))
    parts += [_predictive(outcome), _generations(outcome)]
    if not outcome.checks.empty:
        parts.append(_checks(outcome))
    rows = outcome.simulated if every else outcome.draws
    return Report(rows, _facts(outcome), parts)


def _facts(outcome: Posterior) -> dict[str, Any]:
    tables = ("parameters", "choices", "predictive", "generations", "checks", "ranks")
    return {
        "study": outcome.study,
        "calibrate": outcome.rule.as_json(),
        "data_trials": outcome.data_trials,
        "finished": outcome.finished,
        "missing": outcome.missing,
        "simulations": outcome.simulations,
        "tolerance": outcome.tolerance,
        "effective": outcome.effective,
        "fit": None if math.isnan(outcome.fit) else outcome.fit,
        "checked": not outcome.checks.empty,
        **{name: json_rows(getattr(outcome, name)) for name in tables},
        "draws": json_rows(outcome.draws),
    }


def _fit(outcome: Posterior) -> Iterator[str]:
    """Yield lines on the distance of the data from what the model can do."""
    if not math.isnan(outcome.fit):
        far = f"{percent(outcome.fit)} of data sets from the prior are as far away"
        if outcome.fit < UNLIKELY:
            yield (
                f"misfit: only {far} from the simulations as the data:"
                " the model hardly produces such data, so the intervals mean little"
            )
        else:
            yield f"fit: {far} from the simulations as the data"
    for row in outcome.predictive.to_dict("records"):
        if not row["prior_low"] <= row["data"] <= row["prior_high"]:
            away = max(row["prior_low"] - row["data"], row["data"] - row["prior_high"])
            yield (
                f"misfit: the {row['summary']} of the data, {brief(row['data'])}, is"
                f" outside of all simulations of the prior, {brief(row['prior_low'])}"
                f" to {brief(row['prior_high'])}, by {away / row['spread']:.2g} spreads"
            )
        elif not row["low"] <= row["data"] <= row["high"]:
            yield (
                f"not reproduced within the tolerance: the {row['summary']} of the"
                f" data, {brief(row['data'])}, is outside of 95 % of the kept"
                " simulations"
            )


def _range(row: Mapping[Any, Any]) -> str:
    return f"{row['prior_low']:.3g} to {row['prior_high']:.3g}"


def _title(outcome: Posterior) -> str:
    checked = "not checked" if outcome.checks.empty else "checked below"
    trials = so_many(outcome.data_trials, "trial")
    return f"{outcome.study}: posterior given {outcome.rule.to} ({trials}), {checked}"


def _parameters(outcome: Posterior) -> TextTable:
    rows = []
    for row in outcome.parameters.to_dict("records"):
        half = (row["high"] - row["low"]) / 2.0
        unit = f" ({row['unit']})" if row["unit"] else ""
        rows.append(
            [
                f"{row['parameter']}{unit}",
                number(row["mean"], half),
                number(row["sd"], half),
                number(row["median"], half),
                f"{number(row['low'], half)} to {number(row['high'], half)}",
                _range(row),
            ]
        )
    return TextTable(
        columns=["parameter", "mean", "sd", "median", "95 % credible", "95 % of prior"],
        rows=rows,
        title=_title(outcome),
        caption="\n".join(_caption(outcome)),
    )


def _caption(outcome: Posterior) -> Iterator[str]:
    rule = outcome.rule
    unit = "of the prior's range" if rule.learnt else "spreads of the prior"
    nearest = so_many(len(outcome.draws), "nearest simulation")
    yield (
        f"the {nearest} of {outcome.simulations:,}, as good as"
        f" {outcome.effective:,.0f} independent draws;"
        f" tolerance {outcome.tolerance:.3g} {unit}"
    )
    if outcome.effective < FEW:
        yield f"fewer than {FEW} independent draws: the estimates are rough"
    if outcome.data_trials != rule.replicates:
        trials = so_many(outcome.data_trials, "trial")
        yield (
            f"the data have {trials}, and a simulation has"
            f" {rule.replicates:,}: with unequal numbers, the summaries have unequal"
            " random errors"
        )
    for row in outcome.parameters.to_dict("records"):
        for end in ("first", "last"):
            if row[end] > PILED_UP:
                yield (
                    f"{percent(row[end])} of the posterior of {row['parameter']} are in"
                    f" the {end} {percent(END)} of the prior: values beyond it may fit"
                    " too"
                )
    if outcome.checks.empty:
        yield (
            "not checked: with checks: 100 under calibrate, synthetic data sets tell"
            " whether the intervals cover the truth"
        )
    if not outcome.finished:
        yield "not finished: launch the study again for further generations"
    if outcome.missing:
        yield f"{so_many(outcome.missing, 'trial')} of the plan are not stored"


def _choices(outcome: Posterior) -> TextTable:
    rows = [
        [
            str(row["parameter"]),
            brief(row["value"]),
            percent(row["prior"]),
            percent(row["posterior"]),
        ]
        for row in outcome.choices.to_dict("records")
    ]
    alone = outcome.parameters.empty
    return TextTable(
        columns=["parameter", "value", "prior", "posterior"],
        rows=rows,
        title=_title(outcome) if alone else "",
        caption="\n".join(_caption(outcome)) if alone else "",
    )


def _predictive(outcome: Posterior) -> TextTable:
    rows = []
    for row in outcome.predictive.to_dict("records"):
        half = (row["high"] - row["low"]) / 2.0
        rows.append(
            [
                str(row["summary"]),
                number(row["data"], half),
                with_interval(row["mean"], row["low"], row["high"]),
                _range(row),
            ]
        )
    return TextTable(
        columns=["summary", "data", "posterior predictive", "range of prior"],
        rows=rows,
        caption="posterior predictive: mean and 95 % of the kept simulations",
    )


def _generations(outcome: Posterior) -> TextTable:
    rows = [
        [
            str(row["generation"]) if row["generation"] else "prior",
            f"{row['simulations']:,}",
            percent(row["accepted"]) if row["generation"] else "-",
            f"{row['tolerance']:.3g}",
            f"{row['effective']:,.0f}",
        ]
        for row in outcome.generations.to_dict("records")
    ]
    return TextTable(
        columns=["generation", "simulations", "accepted", "tolerance", "effective"],
        rows=rows,
        caption=(
            "accepted: nearer than the tolerance before; effective: independent draws"
            " that the kept simulations are worth"
        ),
    )


def _checks(outcome: Posterior) -> TextTable:
    rows = []
    for row in outcome.checks.to_dict("records"):
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
        caption="\n".join(_doubts(outcome)),
    )


def _p(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2g}"


def _doubts(outcome: Posterior) -> Iterator[str]:
    """Yield how to read the checks, and the parameters that fail."""
    yield (
        "synthetic data sets with known parameters went through the same calibration;"
        " coverage with 95 % confidence intervals"
    )
    tested = outcome.checks[outcome.checks["p"].notna()]
    level = UNLIKELY / max(1, len(tested))
    for row in tested.to_dict("records"):
        if row["p"] < level:
            yield (
                f"the ranks of {row['parameter']} are not uniform"
                f" (p = {row['p']:.2g}): do not trust its intervals"
            )
    if tested.empty:
        yield "too few data sets to test whether ranks are uniform"


def settled_in_words(outcome: Posterior) -> str:
    """Return the last generation in words, for `sweep status`."""
    *_, last = outcome.generations.to_dict("records")
    state = "finished" if outcome.finished else "not finished"
    return (
        f"generation {last['generation']}, tolerance {last['tolerance']:.3g},"
        f" {last['effective']:,.0f} independent draws; {state}"
    )


def odds_report(outcome: Odds) -> Report:
    """Return the odds of several models: the CSV has a row per study.

    docs/json.md describes the keys of the JSON form.
    """
    parts: list[TextTable | str] = [*_misfits(outcome), *_cautions(outcome)]
    parts += [_models(outcome), _by_tolerance(outcome)]
    if outcome.told_apart.empty:
        parts.append(
            "whether the summaries tell the models apart was not tested: a prior has"
            f" fewer than {FEWEST_COMPARED} simulations with all summaries"
        )
    else:
        parts.append(_told_apart(outcome))
    tables = ("summaries", "models", "tolerances", "told_apart")
    facts = {
        "to": outcome.to,
        "data_trials": outcome.data_trials,
        "tolerance": outcome.tolerance,
        **{name: json_rows(getattr(outcome, name)) for name in tables},
    }
    return Report(outcome.models, facts, parts)


def _misfits(outcome: Odds) -> Iterator[str]:
    """Yield a line per model that hardly produces the data."""
    rows = outcome.models.to_dict("records")
    misfits = [row for row in rows if row["fit"] < UNLIKELY]
    for row in misfits:
        yield (
            f"misfit: only {percent(row['fit'])} of data sets from the prior of"
            f" {row['study']} are as far away from the simulations as the data"
        )
    if len(misfits) == len(rows):
        yield "no model produces such data: the odds tell the least wrong model"


def _cautions(outcome: Odds) -> Iterator[str]:
    """Yield lines on studies that are not complete, or whose fit is not known."""
    for row in outcome.models.to_dict("records"):
        if math.isnan(row["fit"]):
            yield (
                f"the fit of {row['study']} was not tested: fewer than"
                f" {FEWEST_COMPARED} simulations of the prior have all summaries"
            )
        if not row["finished"]:
            yield (
                f"{row['study']} is not finished: launch the study again for further"
                " generations"
            )
        if row["missing"]:
            trials = so_many(row["missing"], "trial")
            yield f"{trials} of the plan of {row['study']} are not stored"


def _models(outcome: Odds) -> TextTable:
    best = outcome.models["evidence"].argmax()
    rows = []
    for place, row in enumerate(outcome.models.to_dict("records")):
        rows.append(
            [
                str(row["study"]),
                str(row["model"]),
                f"{row['near']:,} of {row['simulations']:,}",
                _significant(row, "evidence"),
                "1" if place == best else _significant(row, "factor"),
                _significant(row, "probability"),
            ]
        )
    trials = so_many(outcome.data_trials, "trial")
    return TextTable(
        columns=["study", "model", "near", "evidence", "Bayes factor", "probability"],
        rows=rows,
        title=f"odds given {outcome.to} ({trials}), equally probable before",
        caption=(
            f"near: simulations within {outcome.tolerance:.3g} spreads of the data;"
            " evidence: the probability of that under the prior; Bayes factor: against"
            " the largest evidence; 95 % confidence intervals. The odds depend on the"
            " priors and on the summaries."
        ),
    )


def _significant(row: Mapping[Any, Any], name: str) -> str:
    value, low, high = (row[f"{name}{end}"] for end in ("", "_low", "_high"))
    return f"{value:.2g} ({low:.2g} to {high:.2g})"


def _by_tolerance(outcome: Odds) -> TextTable:
    models = outcome.models["study"].tolist()
    rows = []
    for tolerance, some in outcome.tolerances.groupby("tolerance"):
        cells = [_significant(row, "probability") for row in some.to_dict("records")]
        rows.append([f"{tolerance:.3g}", *cells])
    return TextTable(
        columns=["tolerance", *models],
        rows=rows,
        caption="probabilities by tolerance: they must not depend on it",
    )


def _told_apart(outcome: Odds) -> TextTable:
    models = outcome.models["study"].tolist()
    rows = []
    for name in models:
        some = outcome.told_apart[outcome.told_apart["study"] == name]
        shares = [percent(share) for share in some["probability"]]
        rows.append([name, *shares, percent(some["right"].iloc[0])])
    return TextTable(
        columns=["data sets of", *models, "told right"],
        rows=rows,
        title="do the summaries tell the models apart?",
        caption=(
            "mean probability of each study, if simulations of the priors are the data;"
            " told right: the most probable study is the true one"
        ),
    )
