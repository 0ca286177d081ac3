"""The headline of README.md: by document, how many statements have which verdict.

`make documents` writes it between two marks. How many statements, exact results,
hypotheses and fits a document has, follows from its claims. Verdicts are those of the
stored scorecard. The repository keeps no results: of a document that no stored
scorecard judges, the verdicts that stand there stay, as long as they are of as many
statements.
"""

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sweep.errors import StoreError
from sweep.published.publications import FULL, Publication, read_without_code
from sweep.published.scorecard import ORDER
from sweep.published.statements import GROUPS, Group, group_of
from sweep.spec.study_folder import SCORECARD
from sweep.store.regular import read_json

FIRST, LAST = (
    "<!-- headline: `make documents` writes it -->",
    "<!-- end of headline -->",
)
BLOCK = re.compile(f"{re.escape(FIRST)}\n.*?{re.escape(LAST)}", re.DOTALL)
NAMES: Mapping[Group, str] = {
    "statement": "statements",
    "exact": "exact results",
    "hypothesis": "hypotheses of ours",
    "fit": "fits",
}
MOST_BYTES = 10_000_000
COUNTS = {str: int}
SHAPE = {
    "scale": str,
    "documents": [{"study": str, "asked": bool, "statements": COUNTS}],
}

Verdicts = Mapping[str, Mapping[str, int]]
"""By document how many statements have which status."""


def counted(publication: Publication) -> dict[Group, int]:
    """How many statements, exact results, hypotheses and fits a document has."""
    found = {(group_of(one), one.statement) for one in publication.claims}
    return {group: sum(kind == group for kind, _ in found) for group in GROUPS}


def known_verdicts(
    block: str, results: Path, publications: Sequence[Publication]
) -> Verdicts:
    """The verdicts of a headline, and those of the scorecard below `results` in their
    place. Raises StoreError for a damaged scorecard.
    """
    there: Verdicts = {
        row["document"]: {str(status): int(row[status]) for status in ORDER}
        for row in rows(block)
        if row.keys() >= {*ORDER}
    }
    judged = read_verdicts(results, publications)
    return {**_of_these(there, publications), **judged}


def read_verdicts(results: Path, publications: Sequence[Publication]) -> Verdicts:
    """The verdicts of the scorecard below `results`, of the documents that were asked;
    none if there is none at the full scale. Raises StoreError for a damaged one.
    """
    path = results / SCORECARD[-1]
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise StoreError(f"{path}: {error}; remove it and reproduce again") from None
    if content["scale"] != FULL:
        return {}
    asked = [one for one in content["documents"] if one["asked"]]
    return _of_these({one["study"]: one["statements"] for one in asked}, publications)


def _of_these(verdicts: Verdicts, publications: Sequence[Publication]) -> Verdicts:
    """The verdicts that are of as many statements as the documents have now."""
    wanted = {one.name: counted(one)["statement"] for one in publications}
    return {
        name: counts
        for name, counts in verdicts.items()
        if sum(counts.values()) == wanted.get(name)
    }


def headline(publications: Sequence[Publication], verdicts: Verdicts) -> str:
    """The table in Markdown, with the marks. Where some documents have verdicts, the
    statements of the others are not run.
    """
    shown = [status for status in ORDER[::-1] if verdicts]
    apart = GROUPS[1:]
    names = ["document", NAMES["statement"], *shown, *(NAMES[one] for one in apart)]
    lines = [f"| {' | '.join(names)} |", f"|---|{'---:|' * (len(names) - 1)}"]
    for one in publications:
        counts = counted(one)
        found = verdicts.get(one.name, {"not run": counts["statement"]})
        cells = [
            one.name,
            counts["statement"],
            *(found.get(status, 0) for status in shown),
            *(counts[group] for group in apart),
        ]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join([FIRST, *lines, LAST])


def rows(block: str) -> list[dict[str, str]]:
    """The rows of a headline, by the names of its columns."""
    lines = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in block.splitlines()
        if line.startswith("|")
    ]
    return [dict(zip(lines[0], line, strict=True)) for line in lines[2:]]


def main() -> None:
    """Write the headline into the file that the first argument names. The second is the
    folder with the publications, and the third that with the results.
    """
    readme, experiments, results = map(Path, sys.argv[1:])
    publications = read_without_code(experiments)
    text = readme.read_text(encoding="utf-8")
    found = BLOCK.search(text)
    verdicts = known_verdicts(found[0] if found else "", results, publications)
    made = headline(publications, verdicts)
    written = BLOCK.sub(lambda _: made, text)
    readme.write_text(written, encoding="utf-8")


if __name__ == "__main__":
    main()
