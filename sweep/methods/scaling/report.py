"""The report of finite-size scaling."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from sweep.analysis import with_interval
from sweep.methods.scaling.analysis import LENGTHS, Scaling
from sweep.tables import Report, StoredStudy, TextTable, brief, json_rows
from sweep.text import so_many


def scaling_report(study: StoredStudy, scaling: Scaling) -> Report:
    """Return the sizes, crossings of cumulants, the collapse and problems of points.

    docs/json.md describes the keys of the JSON form.
    """
    title = f"{study.name}: {scaling.metric} against {scaling.control}"
    crossings = [_crossings(scaling)] if scaling.crossings else []
    parts: list[TextTable | str] = [
        _sizes(scaling, title),
        *crossings,
        *_notes(scaling),
    ]
    return Report(scaling.points, _facts(study, scaling), parts)


def _facts(study: StoredStudy, scaling: Scaling) -> dict[str, Any]:
    return {
        "study": study.name,
        "metric": scaling.metric,
        "control": scaling.control,
        "length": scaling.length,
        "burn_in": scaling.burn_in,
        "confidence": scaling.confidence,
        "left_out": scaling.left_out,
        "stationary": scaling.stationary,
        "points": json_rows(scaling.points),
        "crossings": [_plain(row._asdict()) for row in scaling.crossings],
        "peaks": [_plain(row._asdict()) for row in scaling.peaks],
        "minima": [_plain(row._asdict()) for row in scaling.minima],
        "two_peaks": [_plain(row._asdict()) for row in scaling.two_peaks],
        "collapse": _plain(scaling.collapse._asdict()),
        "order": scaling.order._asdict(),
    }


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """Return values by name, None for numbers that are not finite."""
    return {name: _known(value) for name, value in values.items()}


def _known(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_known(element) for element in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _sizes(scaling: Scaling, title: str) -> TextTable:
    heads = ["n", "L", f"peak of susceptibility at {scaling.control}", "its height"]
    heads += ["least Binder cumulant", "its sign", "two peaks of the order"]
    cells = list[list[str]]()
    rows = zip(
        scaling.curves, scaling.peaks, scaling.minima, scaling.two_peaks, strict=True
    )
    for curve, peak, least, two in rows:
        height = with_interval(peak.height, peak.height_low, peak.height_high)
        if not two.tested:
            shown = "too few trials"
        elif two.significant(scaling.confidence):
            shown = f"yes, at {brief(two.x)}: {two.low:.2g} and {two.high:.2g}"
        else:
            shown = f"not told (p = {two.p:.2g})"
        cumulant = with_interval(least.value, least.low, least.high)
        cells.append(
            [
                f"{curve.n:,}",
                brief(curve.length),
                peak.why or with_interval(*peak[1:4]),
                "-" if peak.why else height,
                f"{cumulant} at {brief(least.x)}",
                least.sign,
                shown,
            ]
        )
    return TextTable(columns=heads, rows=cells, title=title)


def _crossings(scaling: Scaling) -> TextTable:
    return TextTable(
        columns=["sizes", f"cumulants cross at {scaling.control}", "cumulant there"],
        rows=[
            [
                f"{crossing.n:,} and {crossing.other_n:,}",
                with_interval(crossing.x, crossing.low, crossing.high),
                with_interval(crossing.value, crossing.value_low, crossing.value_high),
            ]
            for crossing in scaling.crossings
        ],
    )


def _notes(scaling: Scaling) -> Iterator[str]:
    """Yield the lines below the tables."""
    yield f"transition: {scaling.order.order} ({scaling.order.why})"
    if not scaling.crossings:
        yield "no known crossing of the cumulants of neighbouring sizes"
    yield from _collapse(scaling)
    left = (
        "the first half"
        if scaling.burn_in is None
        else f"{so_many(scaling.burn_in, 'step')}"
    )
    yield (
        f"{100.0 * scaling.confidence:g} % confidence intervals over trials; {left} of"
        f" each trial discarded; {LENGTHS[scaling.length]}"
    )
    if scaling.left_out:
        yield (
            f"{so_many(scaling.left_out, 'trial')} left out: not done, without a value,"
            " or of points with too few trials"
        )
    yield from _states(scaling)


def _collapse(scaling: Scaling) -> Iterator[str]:
    collapse = scaling.collapse
    if collapse.why:
        yield f"no collapse: {collapse.why}"
        return
    labels = (f"critical {scaling.control}", "1/nu", "beta/nu")
    values = (collapse.place, collapse.inverse_nu, collapse.beta_nu)
    estimates = [
        f"{name} {with_interval(*value)}"
        for name, value in zip(labels, values, strict=True)
    ]
    yield f"collapse: {', '.join(estimates)}; quality S = {collapse.quality:.2g}"
    if collapse.quality > 2.0:
        yield (
            "S is above 2: the curves do not collapse within their errors. Exclude"
            " small sizes, and points far from the transition, with --where"
        )


def _states(scaling: Scaling) -> Iterator[str]:
    states = scaling.states
    total = so_many(len(states), "point")
    flagged = states[states["problems"] != ""]
    for why, rows in flagged.groupby("problems"):
        places = _places(scaling, rows[["n", scaling.control]].to_numpy().tolist())
        yield f"not stationary: {len(rows)} of {total}, {why}: {places}"
    if flagged.empty:
        yield f"no evidence against a steady state of the {total}"
    if states["tau"].notna().any():
        longest = states.sort_values("tau").iloc[-1]
        yield (
            f"longest autocorrelation time: {longest['tau']:,.0f} steps, at n ="
            f" {longest['n']:,.0f}, {scaling.control} ="
            f" {brief(longest[scaling.control])}"
        )


def _places(scaling: Scaling, rows: Sequence[Sequence[float]]) -> str:
    shown = [f"n = {n:,.0f}, {scaling.control} = {brief(x)}" for n, x in rows[:3]]
    return "; ".join(shown) + ("; ..." if len(rows) > 3 else "")
