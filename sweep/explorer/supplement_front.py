"""The texts around the figure of a supplement.

The texts are for a reader who has only this page: title, citation, commands that run
the study again, and the origin of the numbers.
"""

from datetime import UTC, datetime
from typing import Any

from sweep.explorer.publishing import PaperTexts
from sweep.sharing import cite
from sweep.store import machine, machine_said
from sweep.tables import StoredStudy, command_of
from sweep.text import installing, so_many

NEEDS_CODE = (
    "The spec names files of code. `sweep pack` writes spec and code into one file."
)


def front_of(study: StoredStudy, texts: PaperTexts) -> dict[str, Any]:
    """Return the texts around the figure of a supplement, ready for JSON."""
    stated = texts.or_else(PaperTexts(title=f"Study {study.name}"))
    version = machine()["versions"]["boidsweep"]
    works = [work.as_text() for work in cite(study.whole).works]
    return {
        "title": stated.title,
        "authors": list(stated.authors),
        "doi": stated.doi,
        "caption": stated.caption,
        "licence": stated.licence_said,
        "cite": [*([stated.reference] if stated.reference else []), *works],
        "run": [
            f"{installing('view')}  # version {version}",
            f"sweep {command_of(study.spec)} spec.yaml",
            f"sweep view {study.name}",
        ],
        "needs": NEEDS_CODE if "own" in study.provenance else "",
        "origin": _origin(study),
    }


def _origin(study: StoredStudy) -> list[tuple[str, str]]:
    """Return the origin of the numbers, and of the second run."""
    then = study.provenance
    now = machine()
    counts = study.statuses()
    trials = ", ".join(f"{count:,} {name}" for name, count in sorted(counts.items()))
    return [
        ("Study", f"{study.name}: {so_many(counts.total(), 'trial')} ({trials})"),
        ("Model", f"{then['model']}, preset {then['preset']}"),
        ("Kernels", str(then["kernels_sha"])),
        ("Launched on", machine_said(then)),
        ("Run again on", f"{machine_said(now)}, {datetime.now(UTC):%d %B %Y}"),
    ]


def about_page(study: StoredStudy) -> dict[str, str]:
    """Return the origin of the page, for the metadata."""
    return {
        "Study": study.name,
        "Model": f"{study.provenance['model']} {study.provenance['preset']}",
        "kernels_sha": str(study.provenance["kernels_sha"]),
        "Software": f"boidsweep {machine()['versions']['boidsweep']}",
    }
