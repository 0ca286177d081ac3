"""The scorecard of a reproduction for the page.

Each claim has a verdict, the figure that shows the claim, and the trials that test
the claim.
"""

import base64
from pathlib import Path
from typing import Any

from sweep.analysis import number, with_interval
from sweep.errors import ChoiceError, StoreError
from sweep.explorer.asking import AskPicture, AskScorecard
from sweep.explorer.points import spelled_command
from sweep.explorer.watching import Watched
from sweep.published import MARKS
from sweep.spec import SCORECARD, Column
from sweep.store import local_folder, read_json, read_whole
from sweep.tables import spelled
from sweep.text import unknown

MOST_BYTES = 10_000_000
MOST_PICTURE = 20_000_000
FOLDERS = {"full": ".", "quick": "quick"}
"""Folders below the results, by the scale of the scorecard."""
TEXT = str | None
NUMBER = float | int | None
ROW = {
    **dict.fromkeys(("id", "study", "says", "where", "status", "reason"), str),
    **dict.fromkeys(("expect", "spec"), TEXT),
    **dict.fromkeys(("ours", "margin"), NUMBER),
    "trials": int,
}
SHAPE = {"scale": str, "documents": [{"study": str, "title": str}], "rows": [ROW]}


def scorecard(watched: Watched, question: AskScorecard) -> dict[str, Any]:
    """Return the scorecard that is stored below the results.

    `revision` identifies the content of the file. If the page already has this
    revision, the answer has only this key. `rows` have:

    - ``id``, ``says``, ``where``, ``status``, ``reason``, ``trials``: as in
      scorecard.json
    - ``study``: name of the publication
    - ``mark``: sign of the verdict, such as ✓
    - ``published``: expected value, as text
    - ``ours``: estimate with the confidence interval, as text
    - ``picture``: whether there is a figure
    - ``behind``: for each side the stored `study`, `metric`, `half` and `where` of the
      trials, in the words of a page

    `documents` has the titles of publications by name, and `scales` all scales with a
    scorecard. `command` writes the scorecard. Raises StoreError if the scorecard is
    missing or damaged.
    """
    revision = _revision(watched, question.scale)
    if revision and revision == question.known_revision:
        return {"revision": revision}
    content = _read(watched, question.scale)
    return {
        "revision": revision,
        "scale": question.scale,
        "scales": scales(watched),
        "documents": {
            document["study"]: document["title"] for document in content["documents"]
        },
        "rows": [_row(row) for row in content["rows"]],
        "command": spelled_command(
            "reproduce", [], {"--scale": [question.scale]}, watched
        ),
    }


def scales(watched: Watched) -> list[str]:
    """Return the scales that have a scorecard."""
    return [scale for scale in FOLDERS if _file(watched, scale).exists()]


def picture(watched: Watched, question: AskPicture) -> dict[str, Any]:
    """Return the figure that shows a claim: `png`, in base64.

    Raises ChoiceError for a claim without a figure, and StoreError if the figure is not
    stored below the results.
    """
    pictures = [
        row.get("picture")
        for row in _read(watched, question.scale)["rows"]
        if (row["study"], row["id"]) == (question.study, question.claim)
    ]
    if not pictures or not isinstance(pictures[0], str):
        raise ChoiceError(
            f"no figure of claim {question.claim} is stored", question.study
        )
    root = local_folder(watched.results, "the scorecard")
    file = (_file(watched, question.scale).parent / pictures[0]).resolve()
    if file.suffix != ".png" or not file.is_relative_to(root.resolve()):
        raise StoreError(f"{pictures[0]} is not a figure below {root}", question.study)
    try:
        content = read_whole(file, MOST_PICTURE)
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: {error}; reproduce again", question.study) from None
    return {"png": base64.b64encode(content).decode()}


def _file(watched: Watched, scale: str) -> Path:
    if scale not in FOLDERS:
        raise ChoiceError(unknown("scale", scale, FOLDERS))
    root = local_folder(watched.results, "the scorecard")
    return root / FOLDERS[scale] / SCORECARD[-1]


def _revision(watched: Watched, scale: str) -> str:
    """Return a text that changes when a scorecard is written; "" for no scorecard."""
    try:
        status = _file(watched, scale).stat()
    except OSError:
        return ""
    return f"{status.st_mtime_ns:x}-{status.st_size:x}"


def _read(watched: Watched, scale: str) -> dict[str, Any]:
    path = _file(watched, scale)
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
    except FileNotFoundError:
        raise StoreError(f"{path} does not exist; run sweep reproduce") from None
    except (OSError, ValueError) as error:
        raise StoreError(f"{path}: {error}; remove the file, reproduce again") from None
    return content


def _row(row: dict[str, Any]) -> dict[str, Any]:
    copied = ("id", "study", "says", "where", "status", "reason", "trials")
    behind = row.get("behind")
    return {
        **{name: row[name] for name in copied},
        "mark": MARKS.get(row["status"], ""),
        "published": _published(row),
        "ours": _ours(row),
        "picture": bool(row.get("picture")),
        "behind": [_side(side) for side in behind] if behind else [],
    }


def _side(side: dict[str, Any]) -> dict[str, str]:
    """Return the trials that have some parameters, in the words of the page."""
    column = Column.read(side["column"]) if side["column"] else None
    return {
        "study": side["study"],
        "metric": column.metric if column else "",
        "half": "yes" if column and column.half else "",
        "where": ",".join(
            f"{name}={spelled(v)}" for name, v in side["settings"].items()
        ),
    }


def _ours(row: dict[str, Any]) -> str:
    """Return our estimate with the 95 % confidence interval, as on the scorecard."""
    ours = row["ours"]
    interval = row.get("interval")
    if ours is None:
        return ""
    if interval is None or None in interval:
        return number(ours)
    return with_interval(ours, *interval)


def _published(row: dict[str, Any]) -> str:
    """Return the expected value of a claim, in a few words."""
    value = row.get("published")
    if value is None:
        return ""
    if isinstance(value, list):
        return " to ".join(f"{bound:g}" for bound in value)
    if row["expect"] != "value":
        return f"{row['expect']} {value:g}"
    return f"{value:g}" + (f" ± {row['margin']:g}" if row["margin"] else "")
