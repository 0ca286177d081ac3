"""What lies in the folder of a study, and so what no study may be called.

A study may lie in the folder of another: study `a/b` lies in the folder of `a`. That is
safe as long as no part of a study's name is a name that results use.
"""

import re

PARTS, WRITING, DAMAGED, LOCK = "parts", "writing", "damaged", "lock"
CHECKPOINTS, FIGURES = "checkpoints", "figures"
PLAN, ASKED, SPEC = "plan.parquet", "asked.parquet", "spec.yaml"
SCORECARD = ("scorecard.html", "scorecard.md")
STORED = (PARTS, WRITING, DAMAGED, LOCK, CHECKPOINTS, PLAN, ASKED, SPEC)
"""What a launch writes; figures are drawn from it."""
OWN = (*STORED, FIGURES, *SCORECARD)

PART_NAME = re.compile(r"0[0-9]{19}-[0-9a-f]+(\+[0-9a-f]+)?")
"""The time at which the part was stored, in ns, and a token. The first digit is 0 until
the year 2286.
"""

STUDY_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
"""What a folder can be called. A study of an older version may have a name of OWN."""


def taken_name(study: str) -> str | None:
    """The first part of a study's name that is one of OWN, in small or capital
    letters.
    """
    return next((name for name in study.split("/") if name.lower() in OWN), None)
