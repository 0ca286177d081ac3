"""Files in the folder of a study, and the reserved names that a study may not have.

The folder of a study may be inside the folder of another study: the folder of study
`a/b` is in the folder of `a`. The results are safe if no part of the name of a study is
a name of result files.
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
"""Custom code of stored trials, one file per sha256."""
SCORECARD = ("scorecard.html", "scorecard.md", "scorecard.json")
VARIANTS = "variants.json"
STORED = (PARTS, WRITING, DAMAGED, LOCK, CHECKPOINTS, PLAN, ASKED, SPEC)
"""Files and folders that a launch writes. Figures are drawn from these files."""
OWN = (*STORED, FIGURES, *SCORECARD, VARIANTS)

SPEC_ENDINGS = (".yaml", ".yml")
"""Endings that distinguish the file of a spec from the name of a study."""

PART_NAME = re.compile(r"0[0-9]{19}-[0-9a-f]+(\+[0-9a-f]+)?")
"""Name of a part: the time of storage, in ns, and a token.

The first digit is 0 until the year 2286.
"""

STUDY_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
"""Allowed names of folders of studies.

A study of an older version may have a name of OWN.
"""


def _any_case(word: str) -> str:
    """Return the pattern of a word in lower-case or upper-case letters.

    A JSON Schema has no flag for case.
    """
    signs = (dict.fromkeys(letter + letter.upper()) for letter in word)
    return "".join(f"[{''.join(sign)}]" for sign in signs)


TAKEN = re.compile("|".join([*map(_any_case, OWN), CODE.pattern]))
"""Names of result files, within a study or next to the studies."""
DEVICES = "|".join(
    [
        *map(_any_case, ("con", "prn", "aux", "nul")),
        *(f"{_any_case(word)}[0-9]" for word in ("com", "lpt")),
    ]
)
NOWHERE = re.compile(rf"(({DEVICES})(\.[^/]*)?|[^/]*\.)")
"""Names that no folder can have on Windows.

Results must be readable on every system.
"""


MOST_NAME = 200
NAME_WORDS = (
    'names of letters, digits, "_", "-" and "." joined by "/",'
    " none beginning with a dot"
)


def why_no_name(study: str) -> str:
    """Return in words why a study cannot have a name; "" for an allowed name."""
    if not STUDY_NAME.fullmatch(study) or len(study) > MOST_NAME:
        return f'study "{shortened(study)}" is not allowed: {NAME_WORDS}'
    if taken := taken_name(study):
        reason = "is reserved for files of results"
        return f'study "{study}" is not allowed: "{taken}" {reason}'
    if impossible := impossible_name(study):
        reason = "cannot be the name of a folder on Windows"
        return f'study "{study}" is not allowed: "{impossible}" {reason}'
    return ""


def is_own(name: str) -> bool:
    """Return whether a file in the folder of a study belongs to the study, by name."""
    return name in (*STORED, FIGURES) or CODE.fullmatch(name) is not None


def code_file(sha: str) -> str:
    """Return the name of the file of the code with this sha256."""
    return f"code-{sha}.json"


def impossible_name(study: str) -> str | None:
    """Return the first part of a name that no folder can have on Windows."""
    return next(filter(NOWHERE.fullmatch, study.split("/")), None)


def taken_name(study: str) -> str | None:
    """Return the first part of the name of a study that is TAKEN; None without one."""
    return next(filter(TAKEN.fullmatch, study.split("/")), None)


def launched_studies(results: Path) -> list[str]:
    """Return the studies in a folder of results, at most three folders deep."""
    return studies_below(results, *("*/" * depth for depth in range(1, 4)))


def studies_below(results: Path, *depths: str) -> list[str]:
    """Return the studies in a folder, by patterns of their depth.

    Unfinished studies, in a folder `writing`, have no valid name and are left out.
    """
    plans = (plan for depth in depths for plan in results.glob(depth + PLAN))
    names = (plan.parent.relative_to(results).as_posix() for plan in plans)
    return sorted(name for name in names if STUDY_NAME.fullmatch(name))
