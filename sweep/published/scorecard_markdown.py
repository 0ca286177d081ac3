"""The scorecard as Markdown."""

from collections.abc import Iterator

from sweep.published.scorecard import (
    HEADINGS,
    MARKS,
    TITLE,
    Page,
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
from sweep.text import harmless

SPECIAL = str.maketrans(
    {character: f"\\{character}" for character in "\\`*_{}[]<>#|~&"}
)


def as_markdown(page: Page) -> str:
    """The whole page; texts of documents are escaped."""
    return "\n".join(_lines(page)) + "\n"


def _lines(page: Page) -> Iterator[str]:
    yield f"# {TITLE}\n"
    if page.watermark:
        yield (
            f"**{page.watermark}. This page tries the machinery; its verdicts are those"
            " of far too few trials.**\n"
        )
    for status, count in page.counts().items():
        yield f"- {MARKS[status]} **{count}** {status}"
    for status, heading in (
        ("not reproduced", "Not reproduced"),
        ("not testable as published", "Not testable as published"),
    ):
        found = list(page.of_status(status))
        if found:
            yield f"\n## {heading}\n"
        for section, row in found:
            link = f"[{_text(row.claim.where)}](#{section.anchor(row)})"
            yield (
                f"- {section.publication.name}, {link}:"
                f" {_text(sentence(row.claim.says))} {_text(reason(row))}"
            )
    yield "\n## The rule\n"
    yield "\n\n".join(_text(paragraph) for paragraph in rule(page))
    for section in page.sections:
        yield from _section(page, section)
    yield "\n## Where this comes from\n"
    for what, value in origin_lines(page):
        yield f"- {_text(what)}: {_text(value)}"


def _section(page: Page, section: Section) -> Iterator[str]:
    publication = section.publication
    yield f"\n## {_text(publication.title)}\n\n{_text(publication.source)}\n"
    yield f"| {' | '.join(HEADINGS)} |\n|{'---|' * len(HEADINGS)}"
    for row in section.ordered():
        yield f"| {' | '.join(_cells(page, section, row))} |"
    if publication.contradictions:
        yield "\n### Where the document contradicts itself or its data\n"
    for contradiction in publication.contradictions:
        yield f"- {_text(contradiction.where)}: {_text(contradiction.says)}"
    for picture in section.pictures.values():
        yield f"\n### Figure {_text(picture.name)}\n\n{_text(picture.text)}\n"
        if picture.path:
            address = page.link(picture.path)
            yield f"[![{_text(picture.text)}]({address}.png)]({address}.pdf)"
        else:
            yield "It has not been drawn from these trials."


def _cells(page: Page, section: Section, row: Row) -> list[str]:
    status = row.verdict.status
    return [
        (
            f'<a id="{section.anchor(row)}"></a>*{_text(row.claim.where)}.*'
            f" {_text(sentence(row.claim.says))}"
        ),
        *(
            _text(words(row))
            for words in (published_text, ours_text, trials_text, noticeable_text)
        ),
        f"{MARKS[status]} **{status}**. {_text(reason(row))}",
        ", ".join(f"[{text}]({address})" for text, address in page.links(section, row)),
    ]


def _text(text: str) -> str:
    return harmless(" ".join(text.splitlines())).translate(SPECIAL)
