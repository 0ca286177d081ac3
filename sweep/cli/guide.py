"""The command that shows the guide: its chapters, and the pages that it leads to."""

import re
from typing import Annotated

import typer

from sweep.cli.app import app
from sweep.cli.completing import guide_topics
from sweep.errors import ChoiceError
from sweep.spec.built_in import DOCS, GUIDE
from sweep.text import unknown

FENCE = "```"


@app.command()
def guide(
    topic: Annotated[
        str | None,
        typer.Argument(
            help="A topic, or how it begins, as `searching`; without it all are"
            " listed.",
            autocompletion=guide_topics,
        ),
    ] = None,
) -> None:
    """The guide: how to write a spec, to search, to use clusters, and much more.

    It is text in a pipe, as for `sweep guide searching | less`.
    """
    from rich.markdown import Markdown

    from sweep.cli.terminal import console

    topics = all_topics()
    if topic is None:
        width = max(map(len, topics))
        for name, text in topics.items():
            print(f"{name:<{width}}  {title(text)}")
        return
    text = topics[_chosen(topic, topics)]
    out = console()
    if out.is_terminal:
        out.print(Markdown(text, hyperlinks=False))
    else:
        print(text, end="")


def all_topics() -> dict[str, str]:
    """The text of each topic, in Markdown, by its name: the chapters of the guide as
    their headings are linked to, then the pages below docs by their files.
    """
    found = {
        slug(title(text)): text for text in chapters(GUIDE.read_text(encoding="utf-8"))
    }
    pages = sorted(DOCS.glob("*.md"))
    return found | {page.stem: page.read_text(encoding="utf-8") for page in pages}


def chapters(text: str) -> list[str]:
    """The chapters of a page, each from its heading `## ` on. A line in a block of code
    is no heading.
    """
    found: list[list[str]] = []
    in_code = False
    for line in text.splitlines(keepends=True):
        in_code ^= line.startswith(FENCE)
        if line.startswith("## ") and not in_code:
            found.append([])
        if found:
            found[-1].append(line)
    return ["".join(lines).rstrip() + "\n" for lines in found]


def title(text: str) -> str:
    """The first heading of a text."""
    return text.partition("\n")[0].lstrip("# ")


def slug(heading: str) -> str:
    """A heading as links name it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def _chosen(topic: str, topics: dict[str, str]) -> str:
    """The topic of this name, or the only one that begins so, or that has it as a
    word. Raises ChoiceError where there is none.
    """
    wanted = slug(topic)
    begin = [name for name in topics if name.startswith(wanted)]
    within = [name for name in topics if wanted in name.split("-")]
    for found in ([wanted] if wanted in topics else [], begin, within):
        if len(found) == 1:
            return found[0]
    raise ChoiceError(unknown("topic", topic, begin or within or topics))
