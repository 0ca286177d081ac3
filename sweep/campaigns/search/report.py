"""What a report says of a stored search, as plain data, as tables of texts and in
sentences: `sweep search` prints it, and the explorer shows it.
"""

from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from sweep.analysis.notation import number, with_interval
from sweep.campaigns.search.findings import Findings, plain, warnings
from sweep.campaigns.search.outcome import SEARCH, constraints
from sweep.campaigns.search.repetitions import AgainstRandom
from sweep.campaigns.search.sentences import (
    constraint_words,
    counted,
    objective_words,
    verdict,
)
from sweep.spec.objectives import Objective
from sweep.spec.strict_yaml import dump


class ReportTable(NamedTuple):
    """A table of texts, and how to read it. `candidates` has for each row the place of
    its candidate, and `references` that of its reference; -1 where it has none.
    """

    titles: list[str]
    rows: list[list[str]]
    note: str
    candidates: list[int]
    references: list[int]


def report_facts(found: Findings) -> dict[str, Any]:
    """What `sweep search --json` prints. Numbers have all their digits, and what is not
    known is None.
    """
    against = found.against
    return {
        "study": found.study.name,
        **{
            name: value
            for name, value in found.asked_trials.description.items()
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
    }


def searched_text(found: Findings) -> str:
    """What was searched, and what was spent."""
    about, origin = found.asked_trials.description, found.study.provenance
    racing = f"racing at {about['level']:g}" if about["level"] else "no racing"
    bounds = "".join(
        f"\n            {constraint_words(one)}"
        for one in constraints(found.asked_trials)
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


def best_text(found: Findings) -> str:
    """The best settings as lines of a spec, to six digits; "" without a winner."""
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


def report_tables(found: Findings) -> list[ReportTable]:
    """The tables of a report: the chosen and the references, judged on held-out seeds;
    of several objectives also the front, and its differences from the references.
    """
    tables = [judged_table(found), front_table(found), differences_table(found)]
    return [table for table in tables if table is not None]


def judged_table(found: Findings) -> ReportTable | None:
    """What was chosen, and the references, on held-out seeds; None without a winner."""
    if found.winners.empty:
        return None
    several = len(found.objectives) > 1
    places = list(found.asked_trials.description["references"])
    rows, candidates, references = list[list[str]](), list[int](), list[int]()
    for row in _records(found.winners):
        judged = row["held_out"], row["held_out_low"], row["held_out_high"]
        rows.append(
            [
                str(row["candidate"]),
                *([_named(found, row["objective"])] if several else []),
                _interval(row["search"], row["search_low"], row["search_high"]),
                str(row["search_n"]),
                _interval(*judged),
                str(row["held_out_n"]),
                _known(row["optimism"], *judged[1:]),
            ]
        )
        candidates.append(int(row["candidate"]))
        references.append(-1)
    for row in _records(found.references):
        judged = row["held_out"], row["held_out_low"], row["held_out_high"]
        named = [_named(found, row["objective"])] if several else []
        texts = ["", "", _interval(*judged), str(row["held_out_n"]), ""]
        rows.append([row["reference"], *named, *texts])
        candidates.append(-1)
        references.append(places.index(row["reference"]))
    what = "" if several else f"{_named(found, found.objectives[0].column)}, "
    return ReportTable(
        [
            "candidate",
            *(["objective"] if several else []),
            *("search", "blocks", "held out", "held-out blocks", "too good by"),
        ],
        rows,
        f"{what}95 % intervals over so many blocks: of the search each as if"
        " its candidate had not\nbeen chosen, which makes it look too good; held out,"
        " on seeds that no search has seen, they hold together.",
        candidates,
        references,
    )


def front_table(found: Findings) -> ReportTable | None:
    """The chosen of several objectives as a front; None for one objective."""
    if len(found.objectives) == 1 or found.front.empty:
        return None
    rows = []
    for row in _records(found.front):
        beaten = str(row["beaten_by"]) if row["beaten_by"] >= 0 else ""
        on_front = "yes" if row["on_front"] else "no"
        share = "-" if row["share"] is None else f"{100.0 * row['share']:.0f} %"
        knee = f"{on_front}, its knee" if row["knee"] else on_front
        rows.append([str(row["candidate"]), knee, share, beaten])
    return ReportTable(
        ["candidate", "on the held-out front", "in resamples", "beaten by"],
        rows,
        "In resamples: how often a candidate stays on the front when held-out"
        " blocks are drawn again. Beaten by:\nbetter in every objective, beyond"
        " intervals of the paired differences that hold together.",
        found.front["candidate"].tolist(),
        [-1] * len(rows),
    )


def differences_table(found: Findings) -> ReportTable | None:
    """The chosen of several objectives minus the references; None for one objective."""
    if len(found.objectives) == 1 or found.differences.empty:
        return None
    rows, places = [], list(found.asked_trials.description["references"])
    for row in found.differences.to_dict("records"):
        saved = float(row["variance_reduction"])
        rows.append(
            [
                str(row["candidate"]),
                str(row["reference"]),
                _named(found, str(row["objective"])),
                _interval(row["difference"], row["low"], row["high"]),
                str(row["n"]),
                f"{saved:.2g}" if np.isfinite(saved) else "-",
            ]
        )
    return ReportTable(
        ["candidate", "minus", "objective", "difference", "blocks", "seeds save"],
        rows,
        "95 % intervals that hold together, of n pairs of blocks; common seeds"
        " save so many times as many blocks.",
        found.differences["candidate"].tolist(),
        [places.index(name) for name in found.differences["reference"]],
    )


def references_text(found: Findings) -> str:
    """The winner of one objective against the references, in words; "" where there is
    none, and for several objectives.
    """
    if len(found.objectives) > 1 or found.differences.empty:
        return ""
    lines = []
    for row in found.differences.to_dict("records"):
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


def against_text(found: Findings) -> str:
    """The search against random searches; "" where it was not repeated."""
    against = found.against
    if against is None:
        return ""
    budget = found.asked_trials.description["budget"]
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


def _named(found: Findings, column: str) -> str:
    unit = found.units.get(column, "")
    return column + (f" ({unit})" if unit else "")


def _interval(*numbers: float | None) -> str:
    return with_interval(*(np.nan if value is None else value for value in numbers))


def _known(*numbers: float | None) -> str:
    value, low, high = (np.nan if one is None else one for one in numbers)
    return number(value, (high - low) / 2)
