"""The scorecard as one page of HTML. It needs no other file than the figures
beside it.
"""

from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path
from urllib.parse import quote

from sweep.published.scorecard import (
    HEADINGS,
    MARKS,
    TITLE,
    Page,
    Picture,
    Row,
    Section,
    noticeable_text,
    origin_lines,
    ours_text,
    published_text,
    reason,
    rule,
    sentence,
    trials_text,
)
from sweep.published.verdicts import Status

STYLE = Path(__file__).parent / "scorecard.css"
CLASSES: dict[Status, str] = {
    "not reproduced": "no",
    "not testable as published": "untestable",
    "reproduced": "yes",
}


def as_html(page: Page) -> str:
    """The whole page; every text is escaped."""
    return "\n".join(_lines(page)) + "\n"


def _lines(page: Page) -> Iterator[str]:
    yield '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield '<meta name="color-scheme" content="light dark">'
    yield f"<title>{escape(TITLE)}</title>"
    yield f"<style>\n{STYLE.read_text(encoding='utf-8')}</style>\n</head>\n<body>"
    if page.watermark:
        yield (
            f'<div class="watermark" aria-hidden="true">{escape(page.watermark)}</div>'
        )
    yield f"<main>\n<h1>{escape(TITLE)}</h1>"
    if page.watermark:
        yield (
            f'<p class="notice"><strong>{escape(page.watermark)}.</strong> This page'
            " tries the machinery; "
        )
        yield "its verdicts are those of far too few trials.</p>"
    yield from _summary(page)
    for section in page.sections:
        yield from _section(page, section)
    yield '<section>\n<h2>Where this comes from</h2>\n<dl class="origin">'
    for what, value in origin_lines(page):
        yield f"<dt>{escape(what)}</dt><dd>{escape(value)}</dd>"
    yield "</dl>\n</section>\n</main>\n</body>\n</html>"


def _summary(page: Page) -> Iterator[str]:
    yield '<section>\n<ul class="counts">'
    for status, count in page.counts().items():
        yield (
            f'<li class="{CLASSES[status]}"><strong>{count}</strong>'
            f" {_verdict(status)}</li>"
        )
    yield "</ul>"
    yield from _list(page, "not reproduced", "Not reproduced")
    yield from _list(page, "not testable as published", "Not testable as published")
    yield "</section>\n<section>\n<h2>The rule</h2>"
    yield from (f"<p>{escape(paragraph)}</p>" for paragraph in rule(page))
    yield "</section>"


def _list(page: Page, status: Status, heading: str) -> Iterator[str]:
    found = list(page.of_status(status))
    if not found:
        return
    yield f'<h2>{heading}</h2>\n<ul class="list">'
    for section, row in found:
        link = f'<a href="#{quote(section.anchor(row))}">{escape(row.claim.where)}</a>'
        yield (
            f"<li>{escape(section.publication.name)}, {link}:"
            f" {escape(sentence(row.claim.says))} {_reason(row)}</li>"
        )
    yield "</ul>"


def _section(page: Page, section: Section) -> Iterator[str]:
    publication = section.publication
    yield (
        f"<section>\n<h2>{escape(publication.title)}</h2>\n<p"
        f' class="source">{escape(publication.source)}</p>'
    )
    yield '<div class="wide"><table>\n<thead><tr>'
    yield "".join(f'<th scope="col">{escape(heading)}</th>' for heading in HEADINGS)
    yield "</tr></thead>\n<tbody>"
    for row in section.ordered():
        yield _row(page, section, row)
    yield "</tbody>\n</table></div>"
    if publication.contradictions:
        yield "<h3>Where the document contradicts itself or its data</h3>\n<dl>"
        for contradiction in publication.contradictions:
            where, says = escape(contradiction.where), escape(contradiction.says)
            yield f"<dt>{where}</dt><dd>{says}</dd>"
        yield "</dl>"
    yield from _pictures(page, section.pictures.values())
    yield "</section>"


def _row(page: Page, section: Section, row: Row) -> str:
    claim, status = row.claim, row.verdict.status
    links = [
        f'<a href="{quote(address)}">{escape(text)}</a>'
        for text, address in page.links(section, row)
    ]
    cells = [
        (
            f'<td class="claim"><span class="where">{escape(claim.where)}</span>'
            f" {escape(sentence(claim.says))}</td>"
        ),
        f"<td>{escape(published_text(row))}</td>",
        *(
            f'<td class="number">{escape(words(row))}</td>'
            for words in (ours_text, trials_text, noticeable_text)
        ),
        f'<td class="{CLASSES[status]}">{_verdict(status)} {_reason(row)}</td>',
        f"<td>{'<br>'.join(links)}</td>",
    ]
    return f'<tr id="{escape(section.anchor(row))}">{"".join(cells)}</tr>'


def _verdict(status: Status) -> str:
    return (
        f'<span class="verdict"><span aria-hidden="true">{MARKS[status]}</span>'
        f" {status}</span>"
    )


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
                f"<figure>{caption} It has not been drawn from these"
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
