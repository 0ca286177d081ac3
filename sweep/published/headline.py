"""The headline of README.md: by document, how many statements have which verdict.

`make documents` writes it between two marks. How many statements, hypotheses and fits a
document has, follows from its claims. Verdicts are those of the stored scorecard. The
repository keeps no results: where no scorecard is stored, verdicts that stand there
stay, as long as they are of as many statements.
"""

import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sweep.errors import StoreError
from sweep.published.publications import FULL, Publication, read_unasked
from sweep.published.scorecard import ORDER
from sweep.published.statements import GROUP_OF, GROUPS, Group
from sweep.spec.study_folder import SCORECARD
from sweep.store.regular import read_json

FIRST, LAST = (
    "<!-- headline: `make documents` writes it -->",
    "<!-- end of headline -->",
)
BLOCK = re.compile(f"{re.escape(FIRST)}\n.*?{re.escape(LAST)}", re.DOTALL)
NAMES: Mapping[Group, str] = {
    "statement": "statements",
    "hypothesis": "hypotheses of ours",
    "fit": "fits",
}
MOST_BYTES = 10_000_000
COUNTS = {str: int}
SHAPE = {
    "scale": str,
    "documents": [{"study": str, "statements": COUNTS}],
}

Verdicts = Mapping[str, Mapping[str, int]]
"""By document how many statements have which status."""


def counted(publication: Publication) -> dict[Group, int]:
    """How many statements, hypotheses and fits a document has."""
    found = {(GROUP_OF[one.kind], one.statement) for one in publication.claims}
    return {group: sum(kind == group for kind, _ in found) for group in GROUPS}


def read_verdicts(results: Path, publications: Sequence[Publication]) -> Verdicts:
    """The verdicts of the scorecard below `results`; none if there is none at the full
    scale, or if it is of other statements. Raises StoreError for a damaged one.
    """
    path = results / SCORECARD[-1]
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise StoreError(f"{path}: {error}; remove it and reproduce again") from None
    found = {one["study"]: one["statements"] for one in content["documents"]}
    wanted = {one.name: counted(one)["statement"] for one in publications}
    same = {name: sum(counts.values()) for name, counts in found.items()} == wanted
    return found if same and content["scale"] == FULL else {}


def headline(publications: Sequence[Publication], verdicts: Verdicts) -> str:
    """The table in Markdown, with the marks."""
    shown = [status for status in ORDER[::-1] if verdicts]
    names = ["document", NAMES["statement"], *shown, NAMES["hypothesis"], NAMES["fit"]]
    lines = [f"| {' | '.join(names)} |", f"|---|{'---:|' * (len(names) - 1)}"]
    for one in publications:
        counts = counted(one)
        cells = [
            one.name,
            counts["statement"],
            *(verdicts[one.name].get(status, 0) for status in shown),
            counts["hypothesis"],
            counts["fit"],
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


def says(block: str, counts: str) -> bool:
    """Whether a headline has all that the headline `counts` has, besides verdicts."""
    wanted = rows(counts)
    return [
        {name: one.get(name) for name in wanted[0]} for one in rows(block)
    ] == wanted


def main() -> None:
    """Write the headline into the file that the first argument names. The second is the
    folder with the publications, and the third that with the results.
    """
    readme, experiments, results = map(Path, sys.argv[1:])
    publications = read_unasked(experiments)
    text = readme.read_text(encoding="utf-8")
    verdicts = read_verdicts(results, publications)
    made = headline(publications, verdicts)
    written = BLOCK.sub(
        lambda there: there[0] if not verdicts and says(there[0], made) else made, text
    )
    readme.write_text(written, encoding="utf-8")


if __name__ == "__main__":
    main()
