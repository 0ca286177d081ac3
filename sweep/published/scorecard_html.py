"""The scorecard as one page of HTML, which needs no files except figures."""

from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path
from urllib.parse import quote

from sweep.published.judging import Row
from sweep.published.scorecard import (
    COUNTED,
    HEADINGS,
    LISTED,
    MARKS,
    ORDER,
    TITLE,
    TRIED,
    Page,
    Picture,
    Section,
    family_text,
    kind_text,
    noticeable_text,
    origin_lines,
    ours_text,
    published_text,
    reason,
    rule,
    sentence,
    trials_text,
    turning_texts,
    variants_text,
    weakness_text,
)
from sweep.published.statements import Group
from sweep.published.verdicts import Status

STYLE = Path(__file__).parent / "scorecard.css"
CLASSES: dict[Status, str] = {
    "refuted": "no",
    "undecided": "undecided",
    "partial": "undecided",
    "not testable": "untestable",
    "not run": "untestable",
    "confirmed": "yes",
}


def as_html(page: Page) -> str:
    """Return the complete page, with every text escaped."""
    return "\n".join(_lines(page)) + "\n"


def _lines(page: Page) -> Iterator[str]:
    yield '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield '<meta name="color-scheme" content="light dark">'
    yield f"<title>{escape(TITLE)}</title>"
    yield f"<style>\n{STYLE.read_text(encoding='utf-8')}</style>\n</head>\n<body>"
    if page.watermark:
        yield (
            '<div class="watermark" aria-hidden="true"'
            f' data-words="{escape(page.watermark)}"></div>'
        )
    yield f"<main>\n<h1>{escape(TITLE)}</h1>"
    if page.watermark:
        yield (
            f'<p class="notice"><strong>{escape(page.watermark)}.</strong> This page'
            " is a test of the program; "
        )
        yield "the verdicts come from far too few trials.</p>"
    if page.unasked:
        yield f"<p>{escape(page.unasked)}</p>"
    yield from _summary(page)
    for section in page.shown:
        yield from _section(page, section)
    yield '<section>\n<h2>Provenance</h2>\n<dl class="origin">'
    for name, value in origin_lines(page):
        yield f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>"
    yield "</dl>\n</section>\n</main>\n</body>\n</html>"


def _summary(page: Page) -> Iterator[str]:
    yield "<section>"
    for group in COUNTED:
        yield from _counts(page, group)
    for kind, heading in TRIED.items():
        yield f'<h2>{heading}</h2>\n<ul class="list">'
        for section in page.shown:
            name = escape(section.publication.name)
            yield f"<li>{name}: {escape(variants_text(section, kind))}</li>"
        yield "</ul>"
    for status, heading in LISTED.items():
        yield from _list(page, status, heading)
    yield "</section>\n<section>\n<h2>The rule</h2>"
    yield from (f"<p>{escape(paragraph)}</p>" for paragraph in rule())
    yield "</section>"


def _counts(page: Page, group: Group) -> Iterator[str]:
    """Yield the table of a group: statements per verdict, one row per publication."""
    counts = page.counts(group)
    if not counts:
        return
    yield f"<h2>{escape(COUNTED[group])}</h2>"
    yield '<div class="wide"><table class="counts">\n<thead><tr>'
    yield '<th scope="col">document</th>'
    yield "".join(
        f'<th scope="col" class="{CLASSES[status]}">{_verdict(status)}</th>'
        for status in ORDER
    )
    yield "</tr></thead>\n<tbody>"
    for name, statuses in counts.items():
        cells = "".join(
            f'<td class="number">{statuses[status]}</td>' for status in ORDER
        )
        yield f'<tr><th scope="row">{escape(name)}</th>{cells}</tr>'
    yield "</tbody>\n</table></div>"


def _list(page: Page, status: Status, heading: str) -> Iterator[str]:
    listed = list(page.of_status(status))
    if not listed:
        return
    yield f'<h2>{heading}</h2>\n<ul class="list">'
    for section, row in listed:
        link = f'<a href="#{quote(section.anchor(row))}">{escape(row.claim.where)}</a>'
        yield (
            f"<li>{escape(section.publication.name)}, {link}"
            f" ({escape(row.claim.kind)}):"
            f" {escape(sentence(row.claim.says))} {_reason(row)}</li>"
        )
    yield "</ul>"


def _section(page: Page, section: Section) -> Iterator[str]:
    publication = section.publication
    yield (
        f"<section>\n<h2>{escape(publication.title)}</h2>\n<p"
        f' class="source">{escape(publication.source)}</p>'
    )
    yield f"<p>{escape(family_text(section))}</p>"
    yield '<div class="wide"><table>\n<thead><tr>'
    yield "".join(f'<th scope="col">{escape(heading)}</th>' for heading in HEADINGS)
    yield "</tr></thead>\n<tbody>"
    for row in section.ordered():
        yield _row(page, section, row)
    yield "</tbody>\n</table></div>"
    if publication.contradictions:
        yield "<h3>Contradictions within the publication or with its data</h3>\n<dl>"
        for contradiction in publication.contradictions:
            where = escape(contradiction.where)
            yield f"<dt>{where}</dt><dd>{escape(contradiction.says)}</dd>"
        yield "</dl>"
    yield from _pictures(page, [*section.of_claims, *section.pictures.values()])
    yield "</section>"


def _row(page: Page, section: Section, row: Row) -> str:
    claim = row.claim
    status = row.verdict.status
    links = [
        f'<a href="{quote(address)}">{escape(text)}</a>'
        for text, address in page.links(section, row)
    ]
    cells = [
        (
            f'<td class="claim"><span class="where">{escape(claim.where)}</span>'
            f" {escape(sentence(claim.says))}"
            f' <span class="reason">{escape(kind_text(row))}</span></td>'
        ),
        f"<td>{escape(published_text(row))}</td>",
        *(
            f'<td class="number">{escape(words(row))}</td>'
            for words in (ours_text, trials_text, noticeable_text)
        ),
        (
            f'<td class="{CLASSES[status]}">{_verdict(status)}{_weak(section, row)}'
            f" {_reason(row)}</td>"
        ),
        f"<td>{'<br>'.join(map(escape, turning_texts(section, row)))}</td>",
        f"<td>{'<br>'.join(links)}</td>",
    ]
    return f'<tr id="{escape(section.anchor(row))}">{"".join(cells)}</tr>'


def _verdict(status: Status) -> str:
    return (
        f'<span class="verdict"><span aria-hidden="true">{MARKS[status]}</span>'
        f" {status}</span>"
    )


def _weak(section: Section, row: Row) -> str:
    text = weakness_text(section, row)
    return f' <strong class="weak">{escape(text)}</strong>' if text else ""


def _reason(row: Row) -> str:
    return f'<span class="reason">{escape(reason(row))}</span>'


def _pictures(page: Page, pictures: Iterable[Picture]) -> Iterator[str]:
    yield '<div class="figures">'
    for picture in pictures:
        caption = (
            f"<figcaption><strong>{escape(picture.name)}.</strong>"
            f" {escape(picture.text)}"
        )
        if picture.path is None:
            yield (
                f"<figure>{caption} The figure has not been drawn from these"
                " trials.</figcaption></figure>"
            )
            continue
        address = quote(page.link(picture.path))
        image = f'<img src="{address}.png" alt="{escape(picture.text)}" loading="lazy">'
        formats = (
            f' <a href="{address}.png">PNG</a> <a'
            f' href="{address}.pdf">PDF</a></figcaption>'
        )
        yield f'<figure><a href="{address}.png">{image}</a>{caption}{formats}</figure>'
    yield "</div>"
