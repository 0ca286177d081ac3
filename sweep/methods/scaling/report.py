"""The report of finite-size scaling: what flocks of several sizes tell of a
transition.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any

from sweep.analysis.notation import with_interval
from sweep.methods.scaling.analysis import LENGTHS, Scaling
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.reports import Report, TextTable
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many


def scaling_report(study: StoredStudy, found: Scaling) -> Report:
    """Return what each size tells, where cumulants cross, the collapse, and what speaks
    against all of it; docs/json.md says what each key is.
    """
    title = f"{study.name}: {found.metric} against {found.control}"
    crossings = [_crossings(found)] if found.crossings else []
    parts: list[TextTable | str] = [_sizes(found, title), *crossings, *_notes(found)]
    return Report(found.points, _facts(study, found), parts)


def _facts(study: StoredStudy, found: Scaling) -> dict[str, Any]:
    return {
        "study": study.name,
        "metric": found.metric,
        "control": found.control,
        "length": found.length,
        "burn_in": found.burn_in,
        "confidence": found.confidence,
        "left_out": found.left_out,
        "stationary": found.stationary,
        "points": json_rows(found.points),
        "crossings": [_plain(one._asdict()) for one in found.crossings],
        "peaks": [_plain(one._asdict()) for one in found.peaks],
        "minima": [_plain(one._asdict()) for one in found.minima],
        "two_peaks": [_plain(one._asdict()) for one in found.two_peaks],
        "collapse": _plain(found.collapse._asdict()),
        "order": found.order._asdict(),
    }


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """The values, None for what is not known."""
    return {name: _known(value) for name, value in values.items()}


def _known(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_known(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _sizes(found: Scaling, title: str) -> TextTable:
    heads = ["n", "L", f"peak of susceptibility at {found.control}", "its height"]
    heads += ["least Binder cumulant", "its sign", "two peaks of the order"]
    cells = list[list[str]]()
    rows = zip(found.curves, found.peaks, found.minima, found.two_peaks, strict=True)
    for curve, peak, least, two in rows:
        height = with_interval(peak.height, peak.height_low, peak.height_high)
        if not two.tested:
            shown = "too few trials"
        elif two.significant(found.confidence):
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


def _crossings(found: Scaling) -> TextTable:
    return TextTable(
        columns=["sizes", f"cumulants cross at {found.control}", "cumulant there"],
        rows=[
            [
                f"{crossing.n:,} and {crossing.other_n:,}",
                with_interval(crossing.x, crossing.low, crossing.high),
                with_interval(crossing.value, crossing.value_low, crossing.value_high),
            ]
            for crossing in found.crossings
        ],
    )


def _notes(found: Scaling) -> Iterator[str]:
    """What is said below the tables."""
    yield f"transition: {found.order.order} ({found.order.why})"
    if not found.crossings:
        yield "cumulants of neighbouring sizes cross nowhere, as far as is told"
    yield from _collapse(found)
    left = (
        "the first half"
        if found.burn_in is None
        else f"{so_many(found.burn_in, 'step')}"
    )
    yield (
        f"{100.0 * found.confidence:g} % intervals between trials; {left} of each"
        f" trial does not count; {LENGTHS[found.length]}"
    )
    if found.left_out:
        yield f"{so_many(found.left_out, 'trial')} left out: not done, or alone"
    yield from _states(found)


def _collapse(found: Scaling) -> Iterator[str]:
    one = found.collapse
    if one.why:
        yield f"no collapse: {one.why}"
        return
    names = (f"critical {found.control}", "1/nu", "beta/nu")
    values = (one.place, one.inverse_nu, one.beta_nu)
    said = [
        f"{name} {with_interval(*of)}" for name, of in zip(names, values, strict=True)
    ]
    yield f"collapse: {', '.join(said)}; quality S = {one.quality:.2g}"
    if one.quality > 2.0:
        yield (
            "S is above 2: the curves do not collapse within their errors. Points far"
            " from the transition and small sizes belong to no collapse: choose with"
            " --where"
        )


def _states(found: Scaling) -> Iterator[str]:
    states = found.states
    total = so_many(len(states), "point")
    flagged = states[states["problems"] != ""]
    for why, rows in flagged.groupby("problems"):
        places = _places(found, rows[["n", found.control]].to_numpy().tolist())
        yield f"not stationary: {len(rows)} of {total}, {why}: {places}"
    if flagged.empty:
        yield f"nothing speaks against a steady state of the {total}"
    if states["tau"].notna().any():
        longest = states.sort_values("tau").iloc[-1]
        yield (
            f"longest autocorrelation time: {longest['tau']:,.0f} steps, at n ="
            f" {longest['n']:,.0f}, {found.control} = {brief(longest[found.control])}"
        )


def _places(found: Scaling, rows: Sequence[Sequence[float]]) -> str:
    shown = [f"n = {n:,.0f}, {found.control} = {brief(x)}" for n, x in rows[:3]]
    return "; ".join(shown) + ("; ..." if len(rows) > 3 else "")
