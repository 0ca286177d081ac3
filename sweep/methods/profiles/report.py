"""The reports of profiles: means at each position, exponents, and differences."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from sweep.analysis import CONFIDENCE, Interval, with_interval
from sweep.methods.profiles.analysis import (
    MeanProfile,
    ProfileDifference,
    SizeExponent,
    size_exponents,
    with_unit,
)
from sweep.tables import MAX_ROWS, Report, StoredStudy, TextTable, brief, json_rows
from sweep.text import so_many

ZEROS = {"distance": "correlation length"}
"""Name of the first position with the value 0, by axis."""


def profiles_report(study: StoredStudy, means: Sequence[MeanProfile]) -> Report:
    """Return the mean of each profile at each position, as a report."""
    rows = pd.concat([_rows(profile) for profile in means], ignore_index=True)
    derived = pd.DataFrame([row for profile in means for row in _derived(profile)])
    by_size = size_exponents(study, means)
    facts = {
        "study": study.name,
        "confidence": CONFIDENCE,
        "profiles": json_rows(rows),
        "derived": json_rows(derived),
        "sizes": json_rows(pd.DataFrame([_of_sizes(growth) for growth in by_size])),
    }
    parts = list[TextTable | str]()
    if len(derived):
        parts.append(_derived_table(study, derived))
    if by_size:
        parts.append(_size_table(study, by_size))
    shown = 0
    for name in dict.fromkeys(profile.name for profile in means):
        of_name = [profile for profile in means if profile.name == name]
        parts.append(_table(study, of_name, MAX_ROWS - shown))
        shown += sum(len(profile.at) for profile in of_name)
    return Report(rows, facts, parts)


def _rows(profile: MeanProfile) -> pd.DataFrame:
    """Return one row per position, with the parameters that vary."""
    return pd.DataFrame(
        {
            **{
                name: [value] * len(profile.at)
                for name, value in profile.settings.items()
            },
            "profile": profile.name,
            "unit": profile.unit,
            "axis": profile.axis,
            "axis_unit": profile.axis_unit,
            "at": profile.at,
            "individual": profile.individuals or "",
            "mean": profile.value,
            "low": profile.low,
            "high": profile.high,
            "trials": (profile.values == profile.values).sum(axis=0),
        }
    )


def _derived(profile: MeanProfile) -> list[dict[str, Any]]:
    """Return a row for the exponent and the zero of a profile, if it has them."""
    quantities: Mapping[str, Interval | None] = {
        "exponent": profile.exponent,
        ZEROS.get(profile.axis, "zero"): profile.zero,
    }
    return [
        {
            **profile.settings,
            "profile": profile.name,
            "quantity": name,
            "mean": interval.value,
            "low": interval.low,
            "high": interval.high,
            "trials": interval.n,
        }
        for name, interval in quantities.items()
        if interval is not None
    ]


def _derived_table(study: StoredStudy, derived: pd.DataFrame) -> TextTable:
    settings = study.varied
    return TextTable(
        columns=[*settings, "profile", "quantity", "mean", "trials"],
        rows=[
            [
                *(brief(row[name]) for name in settings),
                row["profile"],
                row["quantity"],
                with_interval(row["mean"], row["low"], row["high"]),
                str(row["trials"]),
            ]
            for row in derived.to_dict("records")
        ],
        title=f"{study.name}: exponents and correlation lengths",
        caption="mean over trials with 95 % confidence interval (Student); trials: with"
        " such a value. An exponent is a fit over all positions, or from --start to"
        " --stop",
    )


def _of_sizes(growth: SizeExponent) -> dict[str, Any]:
    return {
        **growth.settings,
        "profile": growth.name,
        "quantity": ZEROS.get(growth.axis, "zero"),
        "least_side": growth.sides[0],
        "largest_side": growth.sides[-1],
        "sizes": len(growth.sides),
        "exponent": growth.exponent.value,
        "low": growth.exponent.low,
        "high": growth.exponent.high,
        "trials": growth.exponent.n,
    }


def _size_table(study: StoredStudy, by_size: Sequence[SizeExponent]) -> TextTable:
    rows = [_of_sizes(growth) for growth in by_size]
    settings = list(by_size[0].settings)
    return TextTable(
        columns=[*settings, "profile", "quantity", "sides", "exponent", "trials"],
        rows=[
            [
                *(brief(row[name]) for name in settings),
                row["profile"],
                row["quantity"],
                f"{brief(row['least_side'])} to {brief(row['largest_side'])}",
                with_interval(row["exponent"], row["low"], row["high"]),
                str(row["trials"]),
            ]
            for row in rows
        ],
        title=f"{study.name}: growth with the side of the world",
        caption="exponent of the quantity over the side, the root of the area, with"
        " 95 % confidence interval (Welch); 1: in proportion to the side. No exponent:"
        " some trials have no such value; trials: with such a value",
    )


def _table(study: StoredStudy, of_name: Sequence[MeanProfile], room: int) -> TextTable:
    first = of_name[0]
    rows = [
        [
            *map(brief, profile.settings.values()),
            position,
            with_interval(value, low, high),
            str(count),
        ]
        for profile in of_name
        for position, value, low, high, count in zip(
            *(profile.positions, profile.value, profile.low, profile.high),
            (profile.values == profile.values).sum(axis=0),
            strict=True,
        )
    ]
    trials = {len(profile.values) for profile in of_name}
    counted = so_many(max(trials), "trial")
    if len(trials) > 1:
        counted = f"{min(trials):,} to {counted}"
    return TextTable(
        columns=[
            *study.varied,
            with_unit(first.axis, first.axis_unit),
            with_unit("mean", first.unit),
            "trials",
        ],
        rows=rows[: max(0, room)],
        title=f"{study.name}: {first.name}, {first.text}",
        caption=f"mean over {study.averaged} of {counted}, with 95 % confidence"
        " intervals that hold for all positions of a profile together",
        hidden=max(0, len(rows) - max(0, room)),
    )


def difference_report(
    a: str,
    b: str,
    differences: Sequence[ProfileDifference],
    left_out: Sequence[str] = (),
) -> Report:
    """Return the differences of two sides at each position, as a report.

    Parameters
    ----------
    a, b : str
        The sides, as a command names them.
    differences : sequence of ProfileDifference
        One per profile.
    left_out : sequence of str
        Reasons for profiles that cannot be compared.
    """
    tables = []
    frames = []
    for difference in differences:
        frames.append(
            pd.DataFrame(
                {
                    "profile": difference.a.name,
                    "axis": difference.a.axis,
                    "at": difference.a.at,
                    "a": difference.a.value,
                    "b": difference.b.value,
                    "difference": difference.value,
                    "low": difference.low,
                    "high": difference.high,
                    "differs": difference.apart,
                }
            )
        )
        tables.append(_difference_table(difference))
    rows = pd.concat(frames, ignore_index=True)
    facts = {"a": a, "b": b, "confidence": CONFIDENCE, "differences": json_rows(rows)}
    reasons = [f"not compared: {reason}" for reason in left_out]
    return Report(rows, facts, [f"A  {a}\nB  {b}", *tables, *reasons])


def _difference_table(difference: ProfileDifference) -> TextTable:
    columns = (
        *(difference.a.at, difference.a.value, difference.b.value),
        *(difference.value, difference.low, difference.high, difference.apart),
    )
    positions = zip(*columns, strict=True)
    return TextTable(
        columns=[
            with_unit(difference.a.axis, difference.a.axis_unit),
            with_unit("A", difference.a.unit),
            with_unit("B", difference.b.unit),
            with_unit("B - A", difference.b.unit),
            "",
        ],
        rows=[
            [
                brief(float(at)),
                f"{a:.3g}",
                f"{b:.3g}",
                with_interval(value, low, high),
                "differs" if apart else "",
            ]
            for at, a, b, value, low, high, apart in positions
        ],
        title=f"{difference.a.name}, {difference.a.text}",
        caption=f"{len(difference.a.values):,} trials of A,"
        f" {len(difference.b.values):,} of B; B - A with 95 % confidence intervals that"
        " hold for all positions together (Welch, Bonferroni)",
    )
