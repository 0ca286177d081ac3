"""What came out of mutants, as it is stored, and as a table."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from tests import ROOT
from tests.mutants.drawing import SEED, Mutant, package_of

FOLDER = ROOT / "build/mutants"
EQUIVALENT = Path(__file__).with_name("equivalent.toml")
KILLED, OPEN, SURVIVED, UNDECIDED = "killed", "open", "survived", "undecided"
SHORT = 8
"""Digits of a revision in the name of a file."""


class Result(NamedTuple):
    """What is known of a mutant.

    Attributes
    ----------
    path, right, wrong, seed
        What the mutant is known by: its module, its lines as they are and as it leaves
        them, and the seed of the sample.
    verdict
        killed, survived, open (no test that is near notices it) or undecided (the time
        was over).
    test
        The test that noticed it; "" if pytest broke off, or if none did.
    """

    path: str
    right: str
    wrong: str
    seed: int
    verdict: str
    test: str

    @classmethod
    def of(cls, mutant: Mutant, verdict: str, test: str = "") -> "Result":
        return cls(mutant.path, *mutant.lines(), SEED, verdict, test)

    @property
    def key(self) -> tuple[str, str, str, int]:
        return self.path, self.right, self.wrong, self.seed


Tell = Callable[[Result], None]
"""Takes a result as soon as it is there."""


def key(mutant: Mutant) -> tuple[str, str, str, int]:
    """What a mutant is known by."""
    return Result.of(mutant, OPEN).key


def file_of(revision: str) -> Path:
    """Where the results of the tests of a revision are."""
    return FOLDER / f"{revision[:SHORT]}.jsonl"


def stored(file: Path) -> list[Result]:
    """All results of a file. A line that was cut is none."""
    if not file.exists():
        return []
    lines = file.read_text(encoding="utf-8").split("\n")[:-1]
    return [Result(**json.loads(line)) for line in lines if line]


def append(file: Path, result: Result) -> None:
    """A result at the end of a file, on a line of its own."""
    file.parent.mkdir(parents=True, exist_ok=True)
    text = file.read_text(encoding="utf-8") if file.exists() else ""
    kept = text[: text.rfind("\n") + 1]  # a line that was cut goes
    line = json.dumps(result._asdict(), ensure_ascii=False)
    file.write_text(f"{kept}{line}\n", encoding="utf-8")


def killers(folder: Path) -> dict[tuple[str, str, str, int], str]:
    """Which test has noticed a mutant in any earlier run."""
    results = [one for file in sorted(folder.glob("*.jsonl")) for one in stored(file)]
    return {one.key: one.test for one in results if "::" in one.test}


def equivalents() -> dict[tuple[str, str, str], str]:
    """Why mutants change nothing, by their paths and lines."""
    table = tomllib.loads(EQUIVALENT.read_text(encoding="utf-8"))
    return {
        (one["path"], one["right"], one["wrong"]): one["reason"]
        for one in table.get("mutant", [])
    }


def table(drawn: list[Mutant], results: list[Result]) -> str:
    """What came out for each package, and what survived."""
    same = equivalents()
    verdicts = {one.key: one.verdict for one in results}
    counted: dict[str, list[str]] = {}
    for mutant in drawn:
        is_same = key(mutant)[:3] in same
        verdict = "equivalent" if is_same else verdicts.get(key(mutant), "not tried")
        counted.setdefault(package_of(mutant.path), []).append(verdict)
    rows = [_row(name, those) for name, those in sorted(counted.items())]
    rows.append(_row("all", [one for those in counted.values() for one in those]))
    head = "package         drawn  equivalent  killed  survived  share killed"
    lines = [head, *rows]
    for verdict in (SURVIVED, UNDECIDED, OPEN):
        alive = [str(one) for one in drawn if verdicts.get(key(one)) == verdict]
        lines += ["", f"{verdict}:", *alive] if alive else []
    reasons = {str(one): same[key(one)[:3]] for one in drawn if key(one)[:3] in same}
    unchanged = [f"{one}\n    {reason}" for one, reason in reasons.items()]
    return "\n".join([*lines, "", "equivalent:", *unchanged])


def _row(name: str, verdicts: list[str]) -> str:
    killed, survived = verdicts.count(KILLED), verdicts.count(SURVIVED)
    share = f"{killed / (killed + survived):.0%}" if killed + survived else "-"
    same = verdicts.count("equivalent")
    return f"{name:<14}{len(verdicts):>7}{same:>12}{killed:>8}{survived:>10}{share:>14}"
