"""The scorecard as Markdown."""

from collections.abc import Iterator

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
from sweep.text import harmless

SPECIAL = str.maketrans(
    {character: f"\\{character}" for character in "\\`*_{}[]<>#|~&"}
)


def as_markdown(page: Page) -> str:
    """Return the complete page, with texts of publications escaped."""
    return "\n".join(_lines(page)) + "\n"


def _lines(page: Page) -> Iterator[str]:
    yield f"# {TITLE}\n"
    if page.watermark:
        yield (
            f"**{page.watermark}. This page is a test of the program; the verdicts come"
            " from far too few trials.**\n"
        )
    if page.unasked:
        yield f"{_text(page.unasked)}\n"
    for group, heading in COUNTED.items():
        counts = page.counts(group)
        if counts:
            yield f"\n## {heading}\n"
            names = " | ".join(f"{MARKS[status]} {status}" for status in ORDER)
            yield f"| publication | {names} |"
            yield f"|---|{'---:|' * len(ORDER)}"
        for name, statuses in counts.items():
            cells = " | ".join(str(statuses[status]) for status in ORDER)
            yield f"| {name} | {cells} |"
    for kind, tried in TRIED.items():
        yield f"\n## {tried}\n"
        for section in page.shown:
            text = _text(variants_text(section, kind))
            yield f"- {_text(section.publication.name)}: {text}"
    for status, heading in LISTED.items():
        listed = list(page.of_status(status))
        if listed:
            yield f"\n## {heading}\n"
        for section, row in listed:
            link = f"[{_text(row.claim.where)}](#{section.anchor(row)})"
            yield (
                f"- {section.publication.name}, {link} ({row.claim.kind}):"
                f" {_text(sentence(row.claim.says))} {_text(reason(row))}"
            )
    yield "\n## The rule\n"
    yield "\n\n".join(_text(paragraph) for paragraph in rule())
    for section in page.shown:
        yield from _section(page, section)
    yield "\n## Provenance\n"
    for name, value in origin_lines(page):
        yield f"- {_text(name)}: {_text(value)}"


def _section(page: Page, section: Section) -> Iterator[str]:
    publication = section.publication
    yield f"\n## {_text(publication.title)}\n\n{_text(publication.source)}\n"
    yield f"{_text(family_text(section))}\n"
    yield f"| {' | '.join(HEADINGS)} |\n|{'---|' * len(HEADINGS)}"
    for row in section.ordered():
        yield f"| {' | '.join(_cells(page, section, row))} |"
    if publication.contradictions:
        yield "\n### Contradictions within the publication or with its data\n"
    for contradiction in publication.contradictions:
        yield f"- {_text(contradiction.where)}: {_text(contradiction.says)}"
    for picture in [*section.of_claims, *section.pictures.values()]:
        yield from _picture(page, picture)


def _picture(page: Page, picture: Picture) -> Iterator[str]:
    yield f"\n### Figure {_text(picture.name)}\n\n{_text(picture.text)}\n"
    if picture.path:
        address = page.link(picture.path)
        yield f"[![{_text(picture.text)}]({address}.png)]({address}.pdf)"
    else:
        yield "The figure has not been drawn from these trials."


def _cells(page: Page, section: Section, row: Row) -> list[str]:
    status = row.verdict.status
    weak = weakness_text(section, row)
    verdict = f"{MARKS[status]} **{status}**" + (f", **{_text(weak)}**" if weak else "")
    return [
        (
            f'<a id="{section.anchor(row)}"></a>*{_text(row.claim.where)}.*'
            f" {_text(sentence(row.claim.says))} ({_text(kind_text(row))})"
        ),
        *(
            _text(text_of(row))
            for text_of in (published_text, ours_text, trials_text, noticeable_text)
        ),
        f"{verdict}. {_text(reason(row))}",
        "; ".join(map(_text, turning_texts(section, row))),
        ", ".join(f"[{text}]({address})" for text, address in page.links(section, row)),
    ]


def _text(text: str) -> str:
    return harmless(" ".join(text.splitlines())).translate(SPECIAL)
