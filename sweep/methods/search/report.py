"""The report of a stored search as plain data, as tables of strings and in sentences.

`sweep search` prints the report, and the results explorer shows the report.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from sweep.analysis import number, with_interval
from sweep.methods.search.asked_trials import read_asked
from sweep.methods.search.findings import Findings, plain, warnings
from sweep.methods.search.objectives import Objective
from sweep.methods.search.outcome import SEARCH, constraints
from sweep.methods.search.repetitions import AgainstRandom
from sweep.methods.search.sentences import (
    constraint_words,
    counted,
    objective_words,
    verdict,
)
from sweep.spec import dump
from sweep.tables import Report, StoredStudy, TextTable


class ReportTable(NamedTuple):
    """A table of strings, with an explanation.

    Attributes
    ----------
    titles : list of str
        Titles of the columns.
    rows : list of list of str
        Strings of the cells.
    note : str
        Explanation of the table.
    candidates : list of int
        Number of the candidate of each row; -1 without a candidate.
    references : list of int
        Index of the reference of each row; -1 without a reference.
    """

    titles: list[str]
    rows: list[list[str]]
    note: str
    candidates: list[int]
    references: list[int]


def search_report(study: StoredStudy) -> Report:
    """Return the report of a search: its candidates, and their held-out results.

    Raises
    ------
    ChoiceError
        If the study is not a search, or `where` has restricted the study.
    StoreError
        If the search has a statistic or distribution that is unknown here.
    """
    findings = Findings(study, read_asked(study))
    parts: list[TextTable | str] = [
        searched_text(findings),
        "\n".join(f"note        {sentence}" for sentence in warnings(findings)),
        best_text(findings),
        *_text_tables(findings),
        references_text(findings),
        against_text(findings),
    ]
    spaced = [shown for part in parts if part for shown in (part, "")]
    return Report(findings.candidates, report_facts(findings), spaced[:-1])


def _text_tables(findings: Findings) -> Iterator[TextTable]:
    """Yield the tables of a report. The first table names each candidate only once."""
    for place, table in enumerate(report_tables(findings)):
        rows = table.rows
        if place == 0:
            rows = [
                ["" if row[0] == above[0] else row[0], *row[1:]]
                for above, row in pairwise([[""], *rows])
            ]
        yield TextTable(table.titles, rows, caption=table.note)


def report_facts(findings: Findings) -> dict[str, Any]:
    """Return the report that `sweep search --json` prints.

    Numbers have all their digits, and unknown numbers are None.
    """
    against = findings.against
    return {
        "study": findings.study.name,
        **{
            name: value
            for name, value in findings.asked_trials.description.items()
            if name != "parameters"
        },
        "spent": findings.spent,
        "warnings": warnings(findings),
        "best": (
            findings.best
            and {
                "candidate": plain(findings.best["candidate"]),
                **findings.settings(findings.best),
            }
        ),
        "candidates": _records(findings.candidates),
        "winners": _records(findings.winners),
        "references": _records(findings.references),
        "differences": _records(findings.differences),
        "front": _records(findings.front) if len(findings.objectives) > 1 else None,
        "against_random": against and _against_json(against),
    }


def searched_text(findings: Findings) -> str:
    """Return the extent of the search, and the trials spent."""
    description = findings.asked_trials.description
    origin = findings.study.provenance
    racing = (
        f"racing at {description['level']:g}" if description["level"] else "no racing"
    )
    bounds = "".join(
        f"\n            {constraint_words(constraint)}"
        for constraint in constraints(findings.asked_trials)
    )
    scenarios = (
        f", over {description['scenarios']} scenarios"
        if description["scenarios"] > 1
        else ""
    )
    aims = "\n            ".join(
        objective_words(objective) + scenarios for objective in findings.objectives
    )
    full = description["blocks"][SEARCH]
    rejected = description["rejected"].get(SEARCH, 0)
    repeated = description["repeated"].get(SEARCH, 0)
    return (
        f"search      {findings.study.name}: {origin['model']} {origin['preset']},"
        f" {', '.join(description['parameters'])}\n"
        f"objective   {aims}{bounds}\n"
        f"sampler     {description['sampler']}, batches of {description['batch']},"
        f" {racing}; up to {full} blocks per candidate\n"
        f"budget      {findings.spent:,} of {description['budget']:,} trials spent\n"
        f"candidates  {counted(findings.candidates, rejected, repeated)}"
    )


def best_text(findings: Findings) -> str:
    """Return the best parameters as lines of a spec, to six digits.

    The string is "" without a winner.
    """
    if findings.best is None:
        return ""
    role = (
        "the winner"
        if len(findings.objectives) == 1
        else "best of the front in the first objective"
    )
    if len(findings.objectives) > 1 and findings.front["knee"].any():
        role = "the knee of the front"
    settings = {
        name: _six_digits(value)
        for name, value in findings.settings(findings.best).items()
    }
    # `dump` writes a mapping of one entry in braces; they are cut off here.
    lines = "".join(
        f"\n  {dump({name: value}).strip()[1:-1]}" for name, value in settings.items()
    )
    return f"# candidate {findings.best['candidate']}, {role}\nfixed:{lines}"


def _six_digits(value: Any) -> Any:
    return float(f"{value:.6g}") if isinstance(value, float) else value


def report_tables(findings: Findings) -> list[ReportTable]:
    """Return the tables of a report.

    The first table has the chosen candidates and the references, judged on held-out
    seeds. With several objectives, the front and its differences from the references
    follow.
    """
    tables = [
        judged_table(findings),
        front_table(findings),
        differences_table(findings),
    ]
    return [table for table in tables if table is not None]


def judged_table(findings: Findings) -> ReportTable | None:
    """Return the chosen candidates and the references, on held-out seeds.

    Returns None without a winner.
    """
    if findings.winners.empty:
        return None
    several = len(findings.objectives) > 1
    places = list(findings.asked_trials.description["references"])
    rows = list[list[str]]()
    candidates = list[int]()
    references = list[int]()
    for row in _records(findings.winners):
        judged = row["held_out"], row["held_out_low"], row["held_out_high"]
        rows.append(
            [
                str(row["candidate"]),
                *([_named(findings, row["objective"])] if several else []),
                _interval(row["search"], row["search_low"], row["search_high"]),
                str(row["search_n"]),
                _interval(*judged),
                str(row["held_out_n"]),
                _known(row["optimism"], *judged[1:]),
            ]
        )
        candidates.append(int(row["candidate"]))
        references.append(-1)
    for row in _records(findings.references):
        judged = row["held_out"], row["held_out_low"], row["held_out_high"]
        named = [_named(findings, row["objective"])] if several else []
        texts = ["", "", _interval(*judged), str(row["held_out_n"]), ""]
        rows.append([row["reference"], *named, *texts])
        candidates.append(-1)
        references.append(places.index(row["reference"]))
    metric = "" if several else f"{_named(findings, findings.objectives[0].column)}, "
    return ReportTable(
        [
            "candidate",
            *(["objective"] if several else []),
            *("search", "blocks", "held out", "held-out blocks", "too good by"),
        ],
        rows,
        f"{metric}95 % confidence intervals over blocks: search intervals ignore that"
        " the candidate was\nchosen, so estimates look too good; held-out intervals, on"
        " new seeds, are simultaneous.",
        candidates=candidates,
        references=references,
    )


def front_table(findings: Findings) -> ReportTable | None:
    """Return the chosen candidates as a front; None for a single objective."""
    if len(findings.objectives) == 1 or findings.front.empty:
        return None
    rows = []
    for row in _records(findings.front):
        beaten = str(row["beaten_by"]) if row["beaten_by"] >= 0 else ""
        on_front = "yes" if row["on_front"] else "no"
        share = "-" if row["share"] is None else f"{100.0 * row['share']:.0f} %"
        knee = f"{on_front}, its knee" if row["knee"] else on_front
        rows.append([str(row["candidate"]), knee, share, beaten])
    return ReportTable(
        ["candidate", "on the held-out front", "in resamples", "beaten by"],
        rows,
        "In resamples: fraction of resamples of held-out blocks in which a candidate"
        " is on the front. Beaten by:\nbetter in every objective, beyond simultaneous"
        " confidence intervals of the paired differences.",
        candidates=findings.front["candidate"].tolist(),
        references=[-1] * len(rows),
    )


def differences_table(findings: Findings) -> ReportTable | None:
    """Return the chosen candidates minus the references; None for one objective."""
    if len(findings.objectives) == 1 or findings.differences.empty:
        return None
    rows = []
    places = list(findings.asked_trials.description["references"])
    for row in findings.differences.to_dict("records"):
        saved = float(row["variance_reduction"])
        rows.append(
            [
                str(row["candidate"]),
                str(row["reference"]),
                _named(findings, str(row["objective"])),
                _interval(row["difference"], row["low"], row["high"]),
                str(row["n"]),
                f"{saved:.2g}" if np.isfinite(saved) else "-",
            ]
        )
    return ReportTable(
        ["candidate", "minus", "objective", "difference", "blocks", "seeds save"],
        rows,
        "simultaneous 95 % confidence intervals of n pairs of blocks; seeds save:"
        " factor saved by common seeds.",
        candidates=findings.differences["candidate"].tolist(),
        references=[places.index(name) for name in findings.differences["reference"]],
    )


def references_text(findings: Findings) -> str:
    """Return sentences on the winner against the references.

    The string is "" without references, and for several objectives.
    """
    if len(findings.objectives) > 1 or findings.differences.empty:
        return ""
    lines = []
    for row in findings.differences.to_dict("records"):
        difference = {end: row[end] for end in ("difference", "low", "high")}
        unit = findings.units.get(findings.objectives[0].column, "")
        sentence = verdict(
            findings.objectives[0],
            difference,
            unit,
            who="The winner",
            whom=str(row["reference"]),
        )
        saved = float(row["variance_reduction"])
        reduction = (
            f"; common seeds save a factor of {saved:.2g}" if np.isfinite(saved) else ""
        )
        lines.append(f"{sentence}\n    (95 %; {row['n']} pairs of blocks{reduction})")
    return "\n".join(lines) + (
        "\nAll intervals are simultaneous." if len(lines) > 1 else ""
    )


def against_text(findings: Findings) -> str:
    """Return sentences on the search against random searches.

    The string is "" if the search was not repeated.
    """
    against = findings.against
    if against is None:
        return ""
    budget = findings.asked_trials.description["budget"]
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
        against.quantity, against.maximize, findings.objectives[0].statistic
    )
    unit = findings.units.get(against.quantity, "")
    difference = {"difference": against.estimate.value, "low": low, "high": high}
    sentence = verdict(
        quantity, difference, unit, who="The search", whom="random search"
    )
    half = (high - low) / 2
    means = [number(sample.mean, half) for sample in against.estimate.samples]
    unit = f" {unit}" if unit else ""
    distribution = against.estimate.distribution
    test = "Welch" if distribution == "normal" else distribution
    return (
        f"{head}\n{sentence}\n    (95 %, {test}; means {means[0]} and {means[1]}{unit})"
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


def _named(findings: Findings, column: str) -> str:
    unit = findings.units.get(column, "")
    return column + (f" ({unit})" if unit else "")


def _interval(*numbers: float | None) -> str:
    return with_interval(*(np.nan if value is None else value for value in numbers))


def _known(*numbers: float | None) -> str:
    value, low, high = (np.nan if cell is None else cell for cell in numbers)
    return number(value, (high - low) / 2)
