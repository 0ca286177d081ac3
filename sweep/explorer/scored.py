"""The scorecard of a reproduction for the page: each claim with its verdict, the figure
that shows it, and the trials that test it.
"""

import base64
from pathlib import Path
from types import NoneType
from typing import Any

from sweep.analysis.notation import number, with_interval
from sweep.errors import ChoiceError, StoreError
from sweep.explorer.asking import AskPicture, AskScorecard
from sweep.explorer.points import spelled_command
from sweep.explorer.watching import Watched
from sweep.spec.recorded import Column
from sweep.spec.study_folder import SCORECARD
from sweep.store.locations import local_folder
from sweep.store.regular import read_json, read_whole
from sweep.tables.choosing import spelled
from sweep.text import unknown

MOST_BYTES, MOST_PICTURE = 10_000_000, 20_000_000
FOLDERS = {"full": ".", "quick": "quick"}
"""Below the results, by the scale of the scorecard."""
TEXT, NUMBER = str | NoneType, float | int | NoneType
ROW = {
    **dict.fromkeys(("id", "study", "says", "where", "status", "reason"), str),
    **dict.fromkeys(("expect", "spec"), TEXT),
    **dict.fromkeys(("ours", "margin"), NUMBER),
    "trials": int,
}
SHAPE = {"scale": str, "documents": [{"study": str, "title": str}], "rows": [ROW]}


def scorecard(watched: Watched, asked: AskScorecard) -> dict[str, Any]:
    """The scorecard that lies below the results.

    `rows` have `id`, `study` (that of the document), `says`, `where`, `status` and
    `reason` as they stand in scorecard.json, `published` and `ours` as texts, `trials`,
    `picture`, whether there is a figure, and `behind`: for each side the stored
    `study`, `metric`, `half` and `where` of the trials, in the words of a page.
    `documents` are their titles by name, `scales` those that there are, and `command`
    writes it. `revision` is a word for the file; where the page has seen it, only that
    is answered. Raises StoreError where there is none, and for a damaged one.
    """
    revision = _revision(watched, asked.scale)
    if revision and revision == asked.seen:
        return {"revision": revision}
    content = _read(watched, asked.scale)
    return {
        "revision": revision,
        "scale": asked.scale,
        "scales": scales(watched),
        "documents": {one["study"]: one["title"] for one in content["documents"]},
        "rows": [_row(row) for row in content["rows"]],
        "command": spelled_command(
            "reproduce", [], {"--scale": [asked.scale]}, watched
        ),
    }


def scales(watched: Watched) -> list[str]:
    """The scales of which there is a scorecard."""
    return [scale for scale in FOLDERS if _file(watched, scale).exists()]


def picture(watched: Watched, asked: AskPicture) -> dict[str, Any]:
    """The figure that shows a claim, `png`, in base64. Raises ChoiceError for a claim
    without one, and StoreError where it is not stored below the results.
    """
    found = [
        row.get("picture")
        for row in _read(watched, asked.scale)["rows"]
        if (row["study"], row["id"]) == (asked.study, asked.claim)
    ]
    if not found or not isinstance(found[0], str):
        raise ChoiceError(f"no figure of claim {asked.claim} is stored", asked.study)
    root = local_folder(watched.results, "the scorecard")
    file = (_file(watched, asked.scale).parent / found[0]).resolve()
    if file.suffix != ".png" or not file.is_relative_to(root.resolve()):
        raise StoreError(f"{found[0]} is no figure below {root}", asked.study)
    try:
        content = read_whole(file, MOST_PICTURE)
    except (OSError, ValueError) as error:
        raise StoreError(f"{file}: {error}; reproduce again", asked.study) from None
    return {"png": base64.b64encode(content).decode()}


def _file(watched: Watched, scale: str) -> Path:
    if scale not in FOLDERS:
        raise ChoiceError(unknown("scale", scale, FOLDERS))
    root = local_folder(watched.results, "the scorecard")
    return root / FOLDERS[scale] / SCORECARD[-1]


def _revision(watched: Watched, scale: str) -> str:
    """A word that changes when a scorecard is written; "" where there is none."""
    try:
        about = _file(watched, scale).stat()
    except OSError:
        return ""
    return f"{about.st_mtime_ns:x}-{about.st_size:x}"


def _read(watched: Watched, scale: str) -> dict[str, Any]:
    path = _file(watched, scale)
    try:
        content: dict[str, Any] = read_json(path, MOST_BYTES, SHAPE)
    except FileNotFoundError:
        raise StoreError(f"there is no {path}; sweep reproduce writes it") from None
    except (OSError, ValueError) as error:
        raise StoreError(f"{path}: {error}; remove it and reproduce again") from None
    return content


def _row(row: dict[str, Any]) -> dict[str, Any]:
    told = ("id", "study", "says", "where", "status", "reason", "trials")
    behind = row.get("behind")
    return {
        **{name: row[name] for name in told},
        "published": _published(row),
        "ours": _ours(row),
        "picture": bool(row.get("picture")),
        "behind": [_side(one) for one in behind] if behind else [],
    }


def _side(side: dict[str, Any]) -> dict[str, str]:
    """Trials in the words of the page: all that have some settings, by a metric."""
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
    """Our estimate with its 95 % interval, as on the scorecard."""
    ours, interval = row["ours"], row.get("interval")
    if ours is None:
        return ""
    if interval is None or None in interval:
        return number(ours)
    return with_interval(ours, *interval)


def _published(row: dict[str, Any]) -> str:
    """What is expected, in a few words."""
    value = row.get("published")
    if value is None:
        return ""
    if isinstance(value, list):
        return " to ".join(f"{bound:g}" for bound in value)
    if row["expect"] != "value":
        return f"{row['expect']} {value:g}"
    return f"{value:g}" + (f" ± {row['margin']:g}" if row["margin"] else "")
