"""The headline of README.md: by publication, the number of statements per verdict.

`make documents` writes the headline between two marks. The numbers of statements, exact
results, hypotheses and fits follow from the claims. Verdicts are read from the stored
scorecard. The repository has no results. So the verdicts of a publication without a
stored scorecard are unchanged, as long as the number of statements is unchanged.
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
from sweep.spec import SCORECARD
from sweep.store import read_json

FIRST = "<!-- headline: `make documents` writes it -->"
LAST = "<!-- end of headline -->"
BLOCK = re.compile(f"{re.escape(FIRST)}\n.*?{re.escape(LAST)}", re.DOTALL)
NAMES: Mapping[Group, str] = {
    "statement": "statements",
    "exact": "exact results",
    "hypothesis": "our own hypotheses",
    "fit": "fits",
}
MOST_BYTES = 10_000_000
COUNTS = {str: int}
SHAPE = {
    "scale": str,
    "documents": [{"study": str, "asked": bool, "statements": COUNTS}],
}

Verdicts = Mapping[str, Mapping[str, int]]
"""By publication, the number of statements per status."""


def counted(publication: Publication) -> dict[Group, int]:
    """Return the numbers of statements, exact results, hypotheses and fits."""
    statements = {(group_of(claim), claim.statement) for claim in publication.claims}
    return {group: sum(kind == group for kind, _ in statements) for group in GROUPS}


def known_verdicts(
    block: str, results: Path, publications: Sequence[Publication]
) -> Verdicts:
    """Return the verdicts of a headline, updated from the stored scorecard.

    Parameters
    ----------
    block : str
        The present headline.
    results : Path
        Folder with the scorecard.
    publications : sequence of Publication
        All publications.

    Raises
    ------
    StoreError
        If the scorecard is damaged.
    """
    present: Verdicts = {
        row["publication"]: {str(status): int(row[status]) for status in ORDER}
        for row in rows(block)
        if row.keys() >= {*ORDER}
    }
    judged = read_verdicts(results, publications)
    return {**_with_same_count(present, publications), **judged}


def read_verdicts(results: Path, publications: Sequence[Publication]) -> Verdicts:
    """Return the verdicts of the scorecard below `results`, for selected publications.

    The mapping is empty without a scorecard at the full scale.

    Raises
    ------
    StoreError
        If the scorecard is damaged.
    """
    path = results / SCORECARD[-1]
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise StoreError(
            f"{path}: {error}; delete the file and reproduce again"
        ) from None
    if content["scale"] != FULL:
        return {}
    selected = [document for document in content["documents"] if document["asked"]]
    return _with_same_count(
        {document["study"]: document["statements"] for document in selected},
        publications,
    )


def _with_same_count(
    verdicts: Verdicts, publications: Sequence[Publication]
) -> Verdicts:
    """Return the verdicts on as many statements as the publications have now."""
    statements = {
        publication.name: counted(publication)["statement"]
        for publication in publications
    }
    return {
        name: counts
        for name, counts in verdicts.items()
        if sum(counts.values()) == statements.get(name)
    }


def headline(publications: Sequence[Publication], verdicts: Verdicts) -> str:
    """Return the table in Markdown, with the marks.

    If some publications have verdicts, the statements of all remaining publications
    are "not run".
    """
    shown = [status for status in ORDER[::-1] if verdicts]
    apart = GROUPS[1:]
    names = [
        "publication",
        NAMES["statement"],
        *shown,
        *(NAMES[group] for group in apart),
    ]
    lines = [f"| {' | '.join(names)} |", f"|---|{'---:|' * (len(names) - 1)}"]
    for publication in publications:
        counts = counted(publication)
        statuses = verdicts.get(publication.name, {"not run": counts["statement"]})
        cells = [
            publication.name,
            counts["statement"],
            *(statuses.get(status, 0) for status in shown),
            *(counts[group] for group in apart),
        ]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join([FIRST, *lines, LAST])


def rows(block: str) -> list[dict[str, str]]:
    """Return the rows of a headline, by the names of columns."""
    lines = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in block.splitlines()
        if line.startswith("|")
    ]
    return [dict(zip(lines[0], line, strict=True)) for line in lines[2:]]


def main() -> None:
    """Write the headline into the file that the first argument names.

    The second argument is the folder of the publications, the third argument the folder
    of results.
    """
    readme, experiments, results = map(Path, sys.argv[1:])
    publications = read_without_code(experiments)
    text = readme.read_text(encoding="utf-8")
    block = BLOCK.search(text)
    verdicts = known_verdicts(block[0] if block else "", results, publications)
    table = headline(publications, verdicts)
    written = BLOCK.sub(lambda _: table, text)
    readme.write_text(written, encoding="utf-8")


if __name__ == "__main__":
    main()
