"""The figures of a publication. A figure is drawn only if what it depends on has
changed.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cache, cached_property
from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from kernels.identity import kernels_sha
from sweep.figures import STYLE, save, saved_about
from sweep.published.forest import forest_figure
from sweep.published.judging import Row
from sweep.published.publications import Publication
from sweep.spec.study_folder import FIGURES
from sweep.tables.stored_study import StoredStudy

FOREST = Path(__file__).with_name("forest.py")


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


class ForestFile:
    """The picture of the rows of a document, and its two files.

    publication  the document
    rows         its rows, judged
    root         the folder below which the picture is written
    watermark    a text across it; "" for none
    results      the folder that the user has named; `root` is it, or lies in it
    """

    text = "every tested claim: ours, both intervals, what was published, the margin"

    def __init__(
        self,
        publication: Publication,
        rows: Sequence[Row],
        root: Path,
        watermark: str,
        results: Path,
    ) -> None:
        self.publication, self.rows = publication, rows
        self.results, self.watermark = results, watermark
        self.path = root / FIGURES / f"scorecard-{publication.name}"

    @property
    def possible(self) -> bool:
        """Whether there is a row to draw."""
        return any(row.verdict.interval for row in self.rows)

    def current(self) -> bool:
        """Whether the files exist and show these rows."""
        return saved_about(self.path).get("Inputs") == self.about["Inputs"]

    def draw(self) -> None:
        """Draw and save it."""
        title, family = self.publication.title, self.publication.family
        figure = forest_figure(title, self.rows, family)
        save(figure, self.path, self.about, self.watermark, below=self.results)

    @cached_property
    def about(self) -> dict[str, str]:
        """The metadata of the files."""
        source = FOREST.read_text(encoding="utf-8")
        shown = [repr(row) for row in self.rows]
        inputs = [shown, source, _house_sources(), matplotlib.__version__]
        return {
            "Document": self.publication.name,
            "Inputs": _hash(json.dumps([*inputs, self.watermark])),
        }


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
