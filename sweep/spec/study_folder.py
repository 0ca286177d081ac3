"""Files in the folder of a study, and the names that a study may therefore not have.

The folder of a study may lie in the folder of another: study `a/b` lies in the folder
of `a`. The results are safe if no part of a study's name is a name that results
use.
"""

import re
from pathlib import Path

from sweep.text import shortened

PARTS = "parts"
WRITING = "writing"
DAMAGED = "damaged"
LOCK = "lock"
CHECKPOINTS = "checkpoints"
FIGURES = "figures"
PLAN = "plan.parquet"
ASKED = "asked.parquet"
SPEC = "spec.yaml"
CODE = re.compile(r"code-([0-9a-f]{64})\.json")
"""Custom code by which trials were computed, a file per sha256."""
SCORECARD = ("scorecard.html", "scorecard.md", "scorecard.json")
VARIANTS = "variants.json"
STORED = (PARTS, WRITING, DAMAGED, LOCK, CHECKPOINTS, PLAN, ASKED, SPEC)
"""Files and folders that a launch writes; figures are drawn from them."""
OWN = (*STORED, FIGURES, *SCORECARD, VARIANTS)

SPEC_ENDINGS = (".yaml", ".yml")
"""Endings that tell the file of a spec from the name of a study."""

PART_NAME = re.compile(r"0[0-9]{19}-[0-9a-f]+(\+[0-9a-f]+)?")
"""Time at which the part was stored, in ns, and a token.

The first digit is 0 until the year 2286.
"""

STUDY_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
"""Allowed names of folders of studies.

A study of an older version may have a name of OWN.
"""


def _any_case(word: str) -> str:
    """Return the pattern of a word in small or capital letters.

    A JSON Schema has no flag for case.
    """
    signs = (dict.fromkeys(letter + letter.upper()) for letter in word)
    return "".join(f"[{''.join(sign)}]" for sign in signs)


TAKEN = re.compile("|".join([*map(_any_case, OWN), CODE.pattern]))
"""Names that results use, within a study or beside the studies."""
DEVICES = "|".join(
    [
        *map(_any_case, ("con", "prn", "aux", "nul")),
        *(f"{_any_case(word)}[0-9]" for word in ("com", "lpt")),
    ]
)
NOWHERE = re.compile(rf"(({DEVICES})(\.[^/]*)?|[^/]*\.)")
"""Names that no folder can have on Windows.

Results are to be read on every system.
"""


MOST_NAME = 200
NAME_WORDS = (
    'names of letters, digits, "_", "-" and "." joined by "/",'
    " none beginning with a dot"
)


def why_no_name(study: str) -> str:
    """Return in words why no study can have a name.

    "" if a study can.
    """
    if not STUDY_NAME.fullmatch(study) or len(study) > MOST_NAME:
        return f'study "{shortened(study)}" is not allowed: {NAME_WORDS}'
    if taken := taken_name(study):
        reason = "is a name that results use themselves"
        return f'study "{study}" is not allowed: "{taken}" {reason}'
    if impossible := impossible_name(study):
        reason = "can be no folder on Windows, where its results should be read too"
        return f'study "{study}" is not allowed: "{impossible}" {reason}'
    return ""


def is_own(name: str) -> bool:
    """Return whether a file of this name in the folder of a study is the study's."""
    return name in (*STORED, FIGURES) or CODE.fullmatch(name) is not None


def code_file(sha: str) -> str:
    """Return the name of the file of the code with this sha256."""
    return f"code-{sha}.json"


def impossible_name(study: str) -> str | None:
    """Return the first part of a name that no folder can have on Windows."""
    return next(filter(NOWHERE.fullmatch, study.split("/")), None)


def taken_name(study: str) -> str | None:
    """Return the first part of a study's name that is TAKEN."""
    return next(filter(TAKEN.fullmatch, study.split("/")), None)


def launched_studies(results: Path) -> list[str]:
    """Return the studies in a folder of results, at most three folders deep."""
    return studies_below(results, *("*/" * depth for depth in range(1, 4)))


def studies_below(results: Path, *depths: str) -> list[str]:
    """Return the studies in a folder, by patterns of their depth.

    A study that a process writes, or has left in `writing`, has no valid name.
    """
    plans = (plan for depth in depths for plan in results.glob(depth + PLAN))
    names = (plan.parent.relative_to(results).as_posix() for plan in plans)
    return sorted(name for name in names if STUDY_NAME.fullmatch(name))
