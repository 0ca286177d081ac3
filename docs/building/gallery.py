"""The gallery: figures of the published studies, each with its commands and verdicts.

It runs few trials of each, so its verdicts are those of a try, and its figures say so.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from shutil import copyfile

from sweep.campaigns.launching import launch
from sweep.design.plan import make_plan
from sweep.published.drawings import WATERMARK, FigureFile
from sweep.published.judging import Row, judged, stored_studies
from sweep.published.publications import Publication, read_all
from sweep.workers.executors import Loky, core_count

MOST_FIGURES = 2
"""Of a document: those that test most of its claims."""
MOST_SECONDS = 4.0
"""Of CPU time for the trials of a figure."""
PICTURES = "_gallery"

HEAD = """\
# Gallery

Each card is a figure of a published study, drawn again with few trials while this site
was built. Below it stand the command that draws it with all its trials, and what the
claims of the document come to. The verdicts are those of few trials: many are still
undecided. [What a verdict means](explanations/verdicts.md) is said apart, and
`sweep reproduce` judges all claims with all trials.

"""


def gallery_page(experiments: Path, results: Path, sources: Path) -> tuple[str, str]:
    """The name and the text of the page. Its trials are stored below `results`, and its
    pictures are written below `sources`.
    """
    cards = [
        card
        for publication in read_all(experiments, quick=True)
        for card in _cards(publication, results, sources)
    ]
    grid = ":::::{grid} 1\n:gutter: 3\n\n" + "\n".join(cards) + ":::::\n"
    return "gallery", HEAD + grid


def chosen_figures(publication: Publication) -> list[str]:
    """The figures of a document that are shown."""
    cheap = [
        name
        for name, drawing in publication.drawings.items()
        if _seconds(publication, drawing.specs) <= MOST_SECONDS
    ]
    tested = Counter(
        claim.figure
        for claim in publication.claims
        if claim.figure in cheap
        and claim.spec in publication.drawings[claim.figure].specs
    )
    return sorted(cheap, key=lambda name: -tested[name])[:MOST_FIGURES]


def _seconds(publication: Publication, specs: Sequence[str]) -> float:
    plans = (make_plan(publication.studies[spec], workers=1) for spec in specs)
    return sum(plan.cpu_seconds for plan in plans)


def _cards(publication: Publication, results: Path, sources: Path) -> Iterator[str]:
    names = chosen_figures(publication)
    needed = {spec for name in names for spec in publication.drawings[name].specs}
    studies = {spec: publication.studies[spec] for spec in sorted(needed)}
    engine = Loky(core_count())
    try:
        for study in studies.values():
            launch(study, results, engine)
    finally:
        engine.stop()
    part = replace(publication, studies=studies)
    stored = stored_studies(part, results)
    rows = judged(part, stored)[0]
    for name in names:
        file = FigureFile(part, name, stored, results, WATERMARK, results)
        if not file.current():
            file.draw()
        picture = f"{PICTURES}/{publication.name}-{name}.png"
        (sources / picture).parent.mkdir(parents=True, exist_ok=True)
        copyfile(file.path.with_suffix(".png"), sources / picture)
        yield _card(part, name, picture, rows)


def _card(
    publication: Publication, name: str, picture: str, rows: Sequence[Row]
) -> str:
    drawing = publication.drawings[name]
    commands = [
        f"sweep launch experiments/{publication.name}/{spec}.yaml"
        for spec in drawing.specs
    ]
    commands.append(f"sweep reproduce --only {publication.name}")
    of_figure = (row for row in rows if row.claim.figure == name)
    shown = [row for row in of_figure if row.verdict.status != "not run"]
    return "\n".join(
        [
            f"::::{{grid-item-card}} {publication.name}: {drawing.text}",
            f"![{drawing.text}](/{picture})",
            "\n```sh",
            *commands,
            "```",
            *_verdicts(publication, shown),
            "::::\n",
        ]
    )


def _verdicts(publication: Publication, rows: Sequence[Row]) -> list[str]:
    """How many claims have which verdict; below it, to be opened, each of them."""
    document = f"[the document](studies/{publication.name}.md)"
    if not rows:
        return [f"\nNothing that {document} says is read off this figure."]
    counts = Counter(row.verdict.status for row in rows)
    told = ", ".join(f"{count} {status}" for status, count in counts.most_common())
    texts = Counter((row.verdict.status, row.claim.says) for row in rows)
    return [
        f"\nClaims of {document} with this figure: {told}.\n",
        ":::{dropdown} The claims",
        *(
            f"- *{status}*{f', {count} rows' if count > 1 else ''}: {says}"
            for (status, says), count in texts.items()
        ),
        ":::",
    ]
