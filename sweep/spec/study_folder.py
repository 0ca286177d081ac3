"""What lies in the folder of a study, and so what no study may be called.

A study may lie in the folder of another: study `a/b` lies in the folder of `a`. That is
safe as long as no part of a study's name is a name that results use.
"""

import re
from pathlib import Path

from sweep.text import shortened

PARTS, WRITING, DAMAGED, LOCK = "parts", "writing", "damaged", "lock"
CHECKPOINTS, FIGURES = "checkpoints", "figures"
PLAN, ASKED, SPEC = "plan.parquet", "asked.parquet", "spec.yaml"
CODE = re.compile(r"code-([0-9a-f]{64})\.json")
"""The code of the user's own by which trials were computed, a file for each sha256."""
SCORECARD = ("scorecard.html", "scorecard.md", "scorecard.json")
VARIANTS = "variants.json"
STORED = (PARTS, WRITING, DAMAGED, LOCK, CHECKPOINTS, PLAN, ASKED, SPEC)
"""What a launch writes; figures are drawn from it."""
OWN = (*STORED, FIGURES, *SCORECARD, VARIANTS)

SPEC_ENDINGS = (".yaml", ".yml")
"""By which a name is that of a file with a spec, where it might be a study's."""

PART_NAME = re.compile(r"0[0-9]{19}-[0-9a-f]+(\+[0-9a-f]+)?")
"""The time at which the part was stored, in ns, and a token. The first digit is 0 until
the year 2286.
"""

STUDY_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
"""What a folder can be called. A study of an older version may have a name of OWN."""


def _any_case(word: str) -> str:
    """The pattern of a word in small or capital letters. A JSON Schema knows no flag
    for that.
    """
    signs = (dict.fromkeys(letter + letter.upper()) for letter in word)
    return "".join(f"[{''.join(sign)}]" for sign in signs)


TAKEN = re.compile("|".join([*map(_any_case, OWN), CODE.pattern]))
"""What results use themselves, within a study or beside the studies."""
DEVICES = "|".join(
    [
        *map(_any_case, ("con", "prn", "aux", "nul")),
        *(f"{_any_case(word)}[0-9]" for word in ("com", "lpt")),
    ]
)
NOWHERE = re.compile(rf"(({DEVICES})(\.[^/]*)?|[^/]*\.)")
"""What no folder can be called on Windows; results are to be read on every system."""


MOST_NAME = 200
NAME_WORDS = (
    'names of letters, digits, "_", "-" and "." joined by "/",'
    " none beginning with a dot"
)


def why_no_name(study: str) -> str:
    """Why no study can be called so, in words; empty if one can."""
    if not STUDY_NAME.fullmatch(study) or len(study) > MOST_NAME:
        return f'study "{shortened(study)}" is not allowed: {NAME_WORDS}'
    if taken := taken_name(study):
        said = "is a name that results use themselves"
        return f'study "{study}" is not allowed: "{taken}" {said}'
    if impossible := impossible_name(study):
        said = "can be no folder on Windows, where its results should be read too"
        return f'study "{study}" is not allowed: "{impossible}" {said}'
    return ""


def is_own(name: str) -> bool:
    """Whether what has this name in the folder of a study is the study's."""
    return name in (*STORED, FIGURES) or CODE.fullmatch(name) is not None


def code_file(sha: str) -> str:
    """The name of the file of the code with this sha256."""
    return f"code-{sha}.json"


def impossible_name(study: str) -> str | None:
    """The first part of a study's name that no folder can have on Windows."""
    return next(filter(NOWHERE.fullmatch, study.split("/")), None)


def taken_name(study: str) -> str | None:
    """The first part of a study's name that is TAKEN."""
    return next(filter(TAKEN.fullmatch, study.split("/")), None)


def launched_studies(results: Path) -> list[str]:
    """The studies in a folder of results, which lie at most three folders deep."""
    return studies_below(results, *("*/" * depth for depth in range(1, 4)))


def studies_below(results: Path, *depths: str) -> list[str]:
    """The studies in a folder, by patterns of how deep they lie.

    What a process is writing, or has left in `writing`, has a name of no study.
    """
    plans = (plan for depth in depths for plan in results.glob(depth + PLAN))
    names = (plan.parent.relative_to(results).as_posix() for plan in plans)
    return sorted(name for name in names if STUDY_NAME.fullmatch(name))
