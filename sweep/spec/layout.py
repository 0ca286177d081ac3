"""What lies in the folder of a study, and so what no study may be called.

A study may lie in the folder of another, as `a/b` in that of `a`. That is safe as long
as no name of the one is a name that the other uses for what it stores.
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
"""When it was stored, in ns, whose first digit is 0 until the year 2286, and a token.
"""

STUDY_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*")
"""What folders can be called. A study of an older version may have a name of OWN."""


def taken_name(study: str) -> str | None:
    """The first name in that of a study which is one of OWN, in whatever letters."""
    return next((name for name in study.split("/") if name.lower() in OWN), None)
