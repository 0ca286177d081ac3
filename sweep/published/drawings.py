"""The figures of a publication. A figure is drawn only if what it depends on has
changed.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from kernels.identity import kernels_sha
from sweep.figures import STYLE, save, saved_about
from sweep.published.forest import forest_figure
from sweep.published.judging import Row
from sweep.published.numerics_figure import compared, numerics_figure
from sweep.published.publications import Publication
from sweep.published.turned import DocumentVariants
from sweep.spec.study_folder import FIGURES
from sweep.tables.stored_study import StoredStudy

WATERMARK = "QUICK: FEW TRIALS"
"""Across pages and figures of the quick scale."""
CLAIM_SOURCES = [
    Path(__file__).with_name(f"{name}.py")
    for name in ("forest", "numerics_figure", "margins")
]


class FigureFile:
    """One figure of a publication, and its two files.

    publication  the publication
    name         the name of the figure
    stored       the stored studies, by the names of their specs
    root         the folder below which the figure is written
    watermark    a text across the figure; "" for none
    results      the folder that the user has named; `root` is it, or lies in it
    """

    def __init__(
        self,
        publication: Publication,
        name: str,
        stored: Mapping[str, StoredStudy],
        root: Path,
        watermark: str,
        results: Path,
    ) -> None:
        self.publication = publication
        self.name = name
        self.drawing = publication.drawings[name]
        self.studies = {
            spec: stored[spec] for spec in self.drawing.specs if spec in stored
        }
        self.results = results
        # The path of both files, without their endings.
        self.path = root / FIGURES / publication.name / name
        self.watermark = watermark

    @property
    def possible(self) -> bool:
        """Whether all studies that the figure needs are stored."""
        return len(self.studies) == len(self.drawing.specs)

    def current(self) -> bool:
        """Whether the files exist and were drawn from what is stored now."""
        return (
            self.possible
            and saved_about(self.path).get("Inputs") == self.about["Inputs"]
        )

    def draw(self) -> None:
        """Draw and save it. Whatever the function of the figure raises is raised."""
        figure = self.drawing.draw(self.studies)
        if not isinstance(figure, Figure):
            raise TypeError(
                "its function must return a figure of matplotlib, not"
                f" {type(figure).__name__}"
            )
        save(figure, self.path, self.about, self.watermark, below=self.results)

    @cached_property
    def about(self) -> dict[str, str]:
        """The metadata of the files. `Inputs` is a hash of everything that the figure
        depends on.
        """
        done = {study.name: _done(study) for study in self.studies.values()}
        specs = [study.spec for study in self.studies.values()]
        sources = [
            path.read_text(encoding="utf-8")
            for ending in ("*.py", "*.csv")
            for path in sorted(self.publication.folder.glob(ending))
        ]
        inputs = [
            done,
            specs,
            kernels_sha(),
            sources,
            _house_sources(),
            matplotlib.__version__,
            self.watermark,
        ]
        return {
            "Study": ", ".join(done),
            "Spec hash": ", ".join(_hash(spec)[:16] for spec in specs),
            "kernels_sha": kernels_sha(),
            "Trials": ", ".join(str(len(trials)) for trials in done.values()),
            "Inputs": _hash(json.dumps(inputs)),
        }


class ClaimsFile:
    """A picture of the claims of a document, and its two files.

    publication  the document
    name         what the picture is called
    text         what it shows, in a line
    make         makes the figure
    inputs       what the figure shows
    root         the folder below which the picture is written
    watermark    a text across it; "" for none
    results      the folder that the user has named; `root` is it, or lies in it
    """

    def __init__(
        self,
        publication: Publication,
        name: str,
        text: str,
        make: Callable[[], Figure],
        inputs: object,
        root: Path,
        watermark: str,
        results: Path,
    ) -> None:
        self.publication, self.name, self.text = publication, name, text
        self.make, self.inputs = make, inputs
        self.results, self.watermark = results, watermark
        self.path = root / FIGURES / f"{name}-{publication.name}"

    def current(self) -> bool:
        """Whether the files exist and show these claims."""
        return saved_about(self.path).get("Inputs") == self.about["Inputs"]

    def draw(self) -> None:
        """Draw and save it."""
        save(self.make(), self.path, self.about, self.watermark, below=self.results)

    @cached_property
    def about(self) -> dict[str, str]:
        """The metadata of the files."""
        sources = [file.read_text(encoding="utf-8") for file in CLAIM_SOURCES]
        inputs = [repr(self.inputs), sources, _house_sources(), matplotlib.__version__]
        return {
            "Document": self.publication.name,
            "Inputs": _hash(json.dumps([*inputs, self.watermark])),
        }


def forest_file(
    publication: Publication,
    rows: Sequence[Row],
    root: Path,
    watermark: str,
    results: Path,
) -> ClaimsFile | None:
    """The picture of the judged rows of a document; None where none has an interval."""
    if not any(row.verdict.interval for row in rows):
        return None
    title, family = publication.title, publication.family
    return ClaimsFile(
        publication,
        "scorecard",
        "every tested claim: ours, both intervals, what was published, the margin",
        lambda: forest_figure(title, rows, family),
        rows,
        root,
        watermark,
        results,
    )


def numerics_file(
    publication: Publication,
    tried: DocumentVariants | None,
    root: Path,
    results: Path,
) -> ClaimsFile | None:
    """The picture of what numerics do to the claims of a document; None where none were
    tried. They are tried at the quick scale, and it has the watermark of that.
    """
    claims = publication.claims
    if not (tried and tried.tried("numerics") and compared(claims, tried)):
        return None
    title, family = publication.title, publication.family
    return ClaimsFile(
        publication,
        "numerics",
        "every tested claim with few trials, as it is and with half the time step,"
        " another order of updates and another seed",
        lambda: numerics_figure(title, claims, tried, family),
        (compared(claims, tried), tried.tried("numerics")),
        root,
        WATERMARK,
        results,
    )


@cache
def _house_sources() -> list[str]:
    """The source texts that all figures share: style, pieces and estimates."""
    shared = [
        STYLE,
        *sorted(STYLE.parent.glob("*.py")),
        *sorted((STYLE.parent.parent / "analysis").glob("*.py")),
    ]
    return [path.read_text(encoding="utf-8") for path in shared]


def _done(study: StoredStudy) -> list[str]:
    statuses = study.store.trial_ids()
    return [
        trial
        for trial in study.plan["trial_id"].to_pylist()
        if statuses.get(trial) == "done"
    ]


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
