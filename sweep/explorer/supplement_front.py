"""What stands about the figure of a supplement for who reads the page alone: texts, how
to cite it, how to run it again, and where its numbers come from.
"""

from datetime import UTC, datetime
from typing import Any

from sweep.explorer.publication import PaperTexts
from sweep.sharing.citing import cite
from sweep.store.origin import machine_said
from sweep.store.provenance import machine
from sweep.tables.search_phases import PHASE
from sweep.tables.stored_study import StoredStudy
from sweep.text import installing, so_many

NEEDS_CODE = (
    "The spec names files of code, which `sweep pack` writes into one file with it."
)


def front_of(study: StoredStudy, texts: PaperTexts) -> dict[str, Any]:
    """What stands about the figure for who reads the page alone."""
    said = texts.or_else(PaperTexts(title=f"Study {study.name}"))
    verb = "search" if PHASE in study.kept_apart else "launch"
    version = machine()["versions"]["boidsweep"]
    works = [work.as_text() for work in cite(study.whole).works]
    return {
        "title": said.title,
        "authors": list(said.authors),
        "doi": said.doi,
        "caption": said.caption,
        "licence": said.licence_said,
        "cite": [*([said.reference] if said.reference else []), *works],
        "run": [
            f"{installing('view')}  # version {version}",
            f"sweep {verb} spec.yaml",
            f"sweep view {study.name}",
        ],
        "needs": NEEDS_CODE if "own" in study.provenance else "",
        "origin": _origin(study),
    }


def _origin(study: StoredStudy) -> list[tuple[str, str]]:
    """Where the numbers come from, and where the runs were repeated."""
    then, now = study.provenance, machine()
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
    """The origin of the page, for its metadata."""
    return {
        "Study": study.name,
        "Model": f"{study.provenance['model']} {study.provenance['preset']}",
        "kernels_sha": str(study.provenance["kernels_sha"]),
        "Software": f"boidsweep {machine()['versions']['boidsweep']}",
    }
