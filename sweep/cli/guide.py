"""The command that shows the guide: its chapters, and the pages that it leads to."""

from typing import Annotated

import typer

from sweep.cli.app import app
from sweep.cli.completing import guide_topics
from sweep.cli.topics import all_topics, slug, title
from sweep.errors import ChoiceError
from sweep.text import unknown


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
    raise ChoiceError(
        unknown("topic (see `sweep guide`)", topic, begin or within or topics)
    )
