"""Finite-size scaling of a study, for a reader in a terminal or for a program."""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any

from rich.table import Table

from sweep.analysis.notation import with_interval
from sweep.cli.terminal import console
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.scaling import LENGTHS, Scaling
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many


def scaling_json(study: StoredStudy, found: Scaling) -> str:
    """All that is known of the transition; docs/json.md says what each key is."""
    return json.dumps(
        {
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
        },
        indent=2,
        allow_nan=False,
    )


def _plain(values: dict[str, Any]) -> dict[str, Any]:
    """The values, None for what is not known."""
    return {name: _known(value) for name, value in values.items()}


def _known(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_known(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def scaling_text(study: StoredStudy, found: Scaling) -> None:
    """Print what each size tells, where cumulants cross, the collapse, and what speaks
    against all of it.
    """
    out = console()
    title = f"{study.name}: {found.metric} against {found.control}"
    out.print(_sizes(found, title))
    if found.crossings:
        out.print(_crossings(found))
    for line in _notes(found):
        out.print(line)


def _sizes(found: Scaling, title: str) -> Table:
    at = found.control
    heads = ["n", "L", f"peak of susceptibility at {at}", "its height"]
    heads += ["least Binder cumulant", "its sign", "two peaks of the order"]
    table = Table(*heads, title=title)
    rows = zip(found.curves, found.peaks, found.minima, found.two_peaks, strict=True)
    for curve, peak, least, two in rows:
        height = with_interval(peak.height, peak.height_low, peak.height_high)
        if not two.tested:
            shown = "too few trials"
        elif two.told(found.confidence):
            shown = f"yes, at {brief(two.x)}: {two.low:.2g} and {two.high:.2g}"
        else:
            shown = f"not told (p = {two.p:.2g})"
        table.add_row(
            f"{curve.n:,}",
            brief(curve.length),
            peak.why or with_interval(*peak[1:4]),
            "-" if peak.why else height,
            f"{with_interval(least.value, least.low, least.high)} at {brief(least.x)}",
            least.sign,
            shown,
        )
    return table


def _crossings(found: Scaling) -> Table:
    table = Table("sizes", f"cumulants cross at {found.control}", "cumulant there")
    for one in found.crossings:
        table.add_row(
            f"{one.n:,} and {one.other_n:,}",
            with_interval(one.x, one.low, one.high),
            with_interval(one.value, one.value_low, one.value_high),
        )
    return table


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
