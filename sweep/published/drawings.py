"""Figures of a publication, drawn only after a change of the inputs."""

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
from sweep.spec import FIGURES
from sweep.tables import StoredStudy

WATERMARK = "QUICK: FEW TRIALS"
"""Watermark of pages and figures of the quick scale."""
CLAIM_SOURCES = [
    Path(__file__).with_name(f"{name}.py")
    for name in ("forest", "numerics_figure", "margins")
]


class FigureFile:
    """A figure of a publication, with two files.

    Parameters
    ----------
    publication : Publication
    name : str
        Name of the figure.
    stored : mapping of str to StoredStudy
        Stored studies by spec.
    root : Path
        Folder below which the figure is written.
    watermark : str
        Text across the figure; "" for none.
    results : Path
        Folder that the user has named; contains `root` or equals `root`.
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
        # The path of the two files, without endings.
        self.path = root / FIGURES / publication.name / name
        self.watermark = watermark

    @property
    def possible(self) -> bool:
        """True if all studies that the figure needs are stored."""
        return len(self.studies) == len(self.drawing.specs)

    def current(self) -> bool:
        """Return True if the files exist and show the presently stored trials."""
        return (
            self.possible
            and saved_about(self.path).get("Inputs") == self.about["Inputs"]
        )

    def draw(self) -> None:
        """Draw the figure and save it.

        Errors of the function of the figure are passed on.

        Raises
        ------
        TypeError
            If the function does not return a figure of matplotlib.
        """
        figure = self.drawing.draw(self.studies)
        if not isinstance(figure, Figure):
            raise TypeError(
                "the function must return a figure of matplotlib, not"
                f" {type(figure).__name__}"
            )
        save(figure, self.path, self.about, self.watermark, below=self.results)

    @cached_property
    def about(self) -> dict[str, str]:
        """Metadata of the files; `Inputs` is a hash of all inputs of the figure."""
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
    """A figure of the claims of a publication, with two files.

    Parameters
    ----------
    publication : Publication
    name : str
        Name of the figure.
    text : str
        Caption of one line.
    make : callable
        Makes the figure.
    inputs : object
        Contents of the figure. The representation decides if the files are up to date.
    root : Path
        Folder below which the figure is written.
    watermark : str
        Text across the figure; "" for none.
    results : Path
        Folder that the user has named; contains `root` or equals `root`.
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
        self.publication = publication
        self.name = name
        self.text = text
        self.make = make
        self.inputs = inputs
        self.results = results
        self.watermark = watermark
        self.path = root / FIGURES / f"{name}-{publication.name}"

    def current(self) -> bool:
        """Return True if the files exist and show the present claims."""
        return saved_about(self.path).get("Inputs") == self.about["Inputs"]

    def draw(self) -> None:
        """Draw the figure and save it."""
        save(self.make(), self.path, self.about, self.watermark, below=self.results)

    @cached_property
    def about(self) -> dict[str, str]:
        """Metadata of the files."""
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
    """Return the forest plot of judged rows, or None without any confidence interval.

    Parameters
    ----------
    publication : Publication
    rows : sequence of Row
        Judged rows of the publication.
    root : Path
        Folder below which the figure is written.
    watermark : str
        Text across the figure; "" for none.
    results : Path
        Folder that the user has named; contains `root` or equals `root`.
    """
    if not any(row.verdict.interval for row in rows):
        return None
    return ClaimsFile(
        publication,
        name="scorecard",
        text="every tested claim: our estimate with two intervals, the published"
        " value and the margin",
        make=lambda: forest_figure(publication.title, rows, publication.family),
        inputs=rows,
        root=root,
        watermark=watermark,
        results=results,
    )


def numerics_file(
    publication: Publication,
    tried: DocumentVariants | None,
    root: Path,
    results: Path,
) -> ClaimsFile | None:
    """Return the figure of the effect of numerics, or None without tried numerics.

    Numerics are tried at the quick scale, so the figure has the watermark of the scale.

    Parameters
    ----------
    publication : Publication
    tried : DocumentVariants or None
        Stored effects of the variants of the publication.
    root : Path
        Folder below which the figure is written.
    results : Path
        Folder that the user has named; contains `root` or equals `root`.
    """
    claims = publication.claims
    if not (tried and tried.tried("numerics") and compared(claims, tried)):
        return None
    return ClaimsFile(
        publication,
        name="numerics",
        text="every tested claim with few trials, unchanged and with half the time"
        " step, another order of updates and another seed",
        make=lambda: numerics_figure(
            publication.title, claims, tried, publication.family
        ),
        inputs=(compared(claims, tried), tried.tried("numerics")),
        root=root,
        watermark=WATERMARK,
        results=results,
    )


@cache
def _house_sources() -> list[str]:
    """Return the source texts that all figures share: style, pieces and estimates."""
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
