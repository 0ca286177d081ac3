"""Supplements that tests write, and what is in them."""

import json
import re
from pathlib import Path
from typing import Any

from sweep.explorer.publishing import PaperTexts
from sweep.explorer.supplement import SupplementChoice, planned
from sweep.tables.stored_study import StoredStudy
from sweep.web.flight import silent
from sweep.workers.executors import Serial
from tests.studies import SMALL

FLOWN = (
    SMALL.replace("[0.5, 1]", "[0.5, 1, 2]")
    .replace("steps: 9", "steps: 60")
    .replace("replicates: 3", "replicates: 4")
)
"""Three points of four trials, long enough to be seen."""


def content_of(page: bytes) -> dict[str, Any]:
    """What the script of a page reads."""
    found = re.search(
        r'<script type="application/json" id="data">(.*?)</script>',
        page.decode(),
        re.DOTALL,
    )
    assert found
    content: dict[str, Any] = json.loads(found[1])
    return content


def page_of(
    study: StoredStudy, texts: PaperTexts | None = None, **choice: Any
) -> bytes:
    """The page of a supplement, whose trials run in this process."""
    plan = planned(study, SupplementChoice(**choice), texts or PaperTexts())
    return plan.content(Serial(), silent)


def written(study: StoredStudy, path: Path, **choice: Any) -> Path:
    """A supplement as a file."""
    path.write_bytes(page_of(study, **choice))
    return path
