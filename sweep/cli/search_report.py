"""What a search found, as text for a terminal and as JSON for programs."""

import json
from io import StringIO
from typing import Any

import numpy as np
import pandas as pd
from rich.table import Table

from sweep.analysis.notation import number, with_interval
from sweep.campaigns.search.asked_trials import read_asked
from sweep.campaigns.search.findings import Findings, plain, warnings
from sweep.campaigns.search.outcome import SEARCH, constraints
from sweep.campaigns.search.repetitions import AgainstRandom
from sweep.campaigns.search.sentences import (
    constraint_words,
    counted,
    objective_words,
    verdict,
)
from sweep.cli.terminal import Terminal
from sweep.spec.objectives import Objective
from sweep.spec.strict_yaml import dump
from sweep.tables.stored_study import StoredStudy

WIDTH = 10_000
"""A table takes what its cells need, and none of them is cut off."""


def text(study: StoredStudy) -> str:
    """The report of a stored search. Raises StoreError if the study is no search."""
    found = Findings(study, read_asked(study))
    parts = [
        _searched(found),
        _warnings_text(found),
        _best_text(found),
        _table_text(found),
    ]
    parts += [_front_text(found), _references_text(found), _against_text(found)]
    return "\n\n".join(part for part in parts if part)


def as_json(study: StoredStudy) -> str:
    """The report as JSON, with all digits. null means unknown. Raises StoreError as
    `text` does.
    """
    found = Findings(study, read_asked(study))
    against = found.against
    return json.dumps(
        {
            "study": study.name,
            **{
                name: value
                for name, value in found.asked.about.items()
                if name != "parameters"
            },
            "spent": found.spent,
            "warnings": warnings(found),
            "best": (
                found.best
                and {
                    "candidate": plain(found.best["candidate"]),
                    **found.settings(found.best),
                }
            ),
            "candidates": _records(found.candidates),
            "winners": _records(found.winners),
            "references": _records(found.references),
            "differences": _records(found.differences),
            "front": _records(found.front) if len(found.objectives) > 1 else None,
            "against_random": against and _against_json(against),
        },
        indent=2,
    )


def _searched(found: Findings) -> str:
    about, origin = found.asked.about, found.study.provenance
    racing = f"racing at {about['level']:g}" if about["level"] else "no racing"
    bounds = "".join(
        f"\n            {constraint_words(one)}" for one in constraints(found.asked)
    )
    scenarios = (
        f", over {about['scenarios']} scenarios" if about["scenarios"] > 1 else ""
    )
    wanted = "\n            ".join(
        objective_words(one) + scenarios for one in found.objectives
    )
    full = about["blocks"][SEARCH]
    rejected, repeated = (
        about["rejected"].get(SEARCH, 0),
        about["repeated"].get(SEARCH, 0),
    )
    return (
        f"search      {found.study.name}: {origin['model']} {origin['preset']},"
        f" {', '.join(about['parameters'])}\nobjective   {wanted}{bounds}\nsampler    "
        f" {about['sampler']}, batches of {about['batch']}, {racing}; up to {full}"
        f" blocks a candidate\nbudget      {found.spent:,} of {about['budget']:,}"
        f" trials spent\ncandidates  {counted(found.candidates, rejected, repeated)}"
    )


def _warnings_text(found: Findings) -> str:
    return "\n".join(f"note        {sentence}" for sentence in warnings(found))


def _best_text(found: Findings) -> str:
    """The best settings as lines of a spec, to six digits."""
    if found.best is None:
        return ""
    what = (
        "the winner"
        if len(found.objectives) == 1
        else "of the front the best in the first objective"
    )
    if len(found.objectives) > 1 and found.front["knee"].any():
        what = "the knee of the front"
    settings = {
        name: _six_digits(value) for name, value in found.settings(found.best).items()
    }
    # `dump` writes a mapping of one entry in braces; they are cut off here.
    lines = "".join(
        f"\n  {dump({name: value}).strip()[1:-1]}" for name, value in settings.items()
    )
    return f"# candidate {found.best['candidate']}, {what}\nfixed:{lines}"


def _six_digits(value: Any) -> Any:
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _table_text(found: Findings) -> str:
    if found.winners.empty:
        return ""
    several = len(found.objectives) > 1
    table = _table(
        "candidate",
        *(["objective"] if several else []),
        "search",
        "blocks",
        "held out",
        "held-out blocks",
        "too good by",
    )
    last = ""
    for row in _records(found.winners):
        judged = row["held_out"], row["held_out_low"], row["held_out_high"]
        cells = [
            _interval(row["search"], row["search_low"], row["search_high"]),
            str(row["search_n"]),
        ]
        cells += [
            _interval(*judged),
            str(row["held_out_n"]),
            _known(row["optimism"], *judged[1:]),
        ]
        who = str(row["candidate"])
        table.add_row(
            "" if who == last else who,
            *([_named(found, row["objective"])] if several else []),
            *cells,
        )
        last = who
    for row in _records(found.references):
        judged = row["held_out"], row["held_out_low"], row["held_out_high"]
        cells = ["", "", _interval(*judged), str(row["held_out_n"]), ""]
        who = row["reference"]
        table.add_row(
            "" if who == last else who,
            *([_named(found, row["objective"])] if several else []),
            *cells,
        )
        last = who
    what = "" if several else f"{_named(found, found.objectives[0].column)}, "
    return (
        _rendered(table)
        + f"\n{what}95 % intervals over so many blocks: of the search each as if"
        " its candidate had not\nbeen chosen, which makes it look too good; held out,"
        " on seeds that no search has seen, they hold together."
    )


def _named(found: Findings, column: str) -> str:
    unit = found.units.get(column, "")
    return column + (f" ({unit})" if unit else "")


def _interval(*numbers: float | None) -> str:
    return with_interval(*(np.nan if value is None else value for value in numbers))


def _known(*numbers: float | None) -> str:
    value, low, high = (np.nan if one is None else one for one in numbers)
    return number(value, (high - low) / 2)


def _front_text(found: Findings) -> str:
    if len(found.objectives) == 1 or found.front.empty:
        return ""
    table = _table("candidate", "on the held-out front", "in resamples", "beaten by")
    for row in _records(found.front):
        beaten = str(row["beaten_by"]) if row["beaten_by"] >= 0 else ""
        on_front = "yes" if row["on_front"] else "no"
        share = "-" if row["share"] is None else f"{100.0 * row['share']:.0f} %"
        table.add_row(
            str(row["candidate"]),
            f"{on_front}, its knee" if row["knee"] else on_front,
            share,
            beaten,
        )
    return (
        _rendered(table)
        + "\nIn resamples: how often a candidate stays on the front when held-out"
        " blocks are drawn again. Beaten by:\nbetter in every objective, beyond"
        " intervals of the paired differences that hold together."
    )


def _references_text(found: Findings) -> str:
    """For one objective: the winner against the references, in words. For several: a
    table with each candidate of the front.
    """
    rows = found.differences.to_dict("records")
    if not rows:
        return ""
    if len(found.objectives) > 1:
        table = _table(
            "candidate", "minus", "objective", "difference", "blocks", "seeds save"
        )
        for row in rows:
            who, whom, what = (
                str(row["candidate"]),
                str(row["reference"]),
                _named(found, str(row["objective"])),
            )
            change = _interval(row["difference"], row["low"], row["high"])
            saved = float(row["variance_reduction"])
            table.add_row(
                who,
                whom,
                what,
                change,
                str(row["n"]),
                f"{saved:.2g}" if np.isfinite(saved) else "-",
            )
        return (
            _rendered(table)
            + "\n95 % intervals that hold together, of n pairs of blocks; common seeds"
            " save so many times as many blocks."
        )
    lines = []
    for row in rows:
        difference = {end: row[end] for end in ("difference", "low", "high")}
        unit = found.units.get(found.objectives[0].column, "")
        said = verdict(
            found.objectives[0], difference, unit, "The winner", str(row["reference"])
        )
        saved = float(row["variance_reduction"])
        reduction = (
            f"; common seeds save a factor of {saved:.2g}" if np.isfinite(saved) else ""
        )
        lines.append(f"{said}\n    (95 %; {row['n']} pairs of blocks{reduction})")
    return "\n".join(lines) + (
        "\nThese intervals hold together." if len(lines) > 1 else ""
    )


def _against_text(found: Findings) -> str:
    against = found.against
    if against is None:
        return ""
    budget = found.asked.about["budget"]
    head = (
        f"{len(against.search)} repetitions of the search against {len(against.random)}"
        " random searches"
    )
    head += f" of {budget:,} trials each, winners on held-out seeds:"
    missing = [
        f"\n{count} {kind} without a judged winner"
        for count, kind in zip(
            against.without, ("repetitions", "random searches"), strict=True
        )
        if count
    ]
    if not against.estimate.testable:
        return head + " too few to compare" + "".join(missing)
    low, high = against.estimate.interval()
    quantity = Objective(
        against.quantity, against.maximize, found.objectives[0].statistic
    )
    unit = found.units.get(against.quantity, "")
    difference = {"difference": against.estimate.value, "low": low, "high": high}
    said = verdict(quantity, difference, unit, "The search", "random search")
    half = (high - low) / 2
    means = [number(sample.mean, half) for sample in against.estimate.samples]
    unit = f" {unit}" if unit else ""
    of = against.estimate.distribution
    test = "Welch" if of == "normal" else of
    return (
        f"{head}\n{said}\n    (95 %, {test}; means {means[0]} and {means[1]}{unit})"
        + "".join(missing)
    )


def _against_json(against: AgainstRandom) -> dict[str, Any]:
    testable = against.estimate.testable
    low, high = against.estimate.interval() if testable else (None, None)
    return {
        "quantity": against.quantity,
        "maximize": against.maximize,
        "search": against.search.tolist(),
        "random": against.random.tolist(),
        "without": list(against.without),
        "difference": plain(against.estimate.value) if testable else None,
        "low": low,
        "high": high,
    }


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    return [
        {str(name): plain(value) for name, value in row.items()}
        for row in table.to_dict("records")
    ]


def _table(*columns: str) -> Table:
    table = Table()
    for column in columns:
        table.add_column(column, no_wrap=True)
    return table


def _rendered(table: Table) -> str:
    stream = StringIO()
    # Without these options rich would display the table at once in a notebook, and
    # would use bold type where FORCE_COLOR is set.
    Terminal(file=stream, width=WIDTH, force_jupyter=False, force_terminal=False).print(
        table
    )
    return stream.getvalue().rstrip("\n")
