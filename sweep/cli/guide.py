"""The command that shows the guide: the pages of the guide, and linked pages."""

import re
from typing import Annotated

import typer

from sweep.cli.app import Group, app
from sweep.cli.completing import guide_topics
from sweep.cli.topics import (
    Topic,
    all_topics,
    earlier_names,
    readable,
    search,
    slug,
)
from sweep.errors import ChoiceError
from sweep.text import shortened, similar, unknown

FEW = 6
"""Maximum number of topics in an error."""


@app.command(rich_help_panel=Group.start)
def guide(
    topic: Annotated[
        list[str] | None,
        typer.Argument(
            help="Topic, or the beginning of a topic, such as `searching`; by default a"
            " list of all topics. With --search: words to find.",
            autocompletion=guide_topics,
        ),
    ] = None,
    find: Annotated[
        bool,
        typer.Option(
            "--search", help="Find the paragraphs that contain all these words."
        ),
    ] = False,
) -> None:
    """Show the user guide in the terminal.

    In a pipe, prints plain text, for example for `less`. With --search, prints the
    topic, the heading and the line of each paragraph that contains all words.

    Examples
    --------
    sweep guide writing-a-spec
    sweep guide --search packet loss
    """
    from rich.markdown import Markdown

    from sweep.cli.terminal import console

    topics = all_topics()
    query = " ".join(topic or [])
    if find:
        _print_hits(query, topics)
        return
    if not query:
        width = max(map(len, topics))
        for name, page in topics.items():
            print(f"{name:<{width}}  {page.title}")
        return
    text = readable(_chosen(query, topics), topics)
    out = console()
    if out.is_terminal:
        out.print(Markdown(text, hyperlinks=False))
    else:
        print(text, end="")


def _chosen(topic: str, topics: dict[str, Topic]) -> str:
    """Return the topic of this name, or the only topic with this beginning or word.

    Raises ChoiceError if there is no such topic.
    """
    link = earlier_names(topics).get(slug(topic), slug(topic))
    exact = [name for name in topics if name == link]
    begin = [name for name in topics if name.startswith(link)]
    within = [name for name in topics if link in name.split("-")]
    for matches in (exact, begin, within):
        if len(matches) == 1:
            return matches[0]
    mentions = list(dict.fromkeys(hit.topic for hit in search(topic, topics)))
    if begin or within or not mentions:
        kind = "topic (see `sweep guide`)"
        raise ChoiceError(unknown(kind, topic, begin or within or topics))
    more = ", ..." if len(mentions) > FEW else ""
    raise ChoiceError(
        f'no topic is called "{shortened(topic)}"; topics that contain the word (sweep'
        f" guide --search {shortened(topic)}): {', '.join(mentions[:FEW])}{more}"
    )


def _print_hits(query: str, topics: dict[str, Topic]) -> None:
    """Print each paragraph that has the words, below the name of the topic."""
    if not query.strip():
        raise ChoiceError(
            "--search needs a word, for example sweep guide --search torus"
        )
    topic = ""
    for hit in search(query, topics):
        if hit.topic != topic:
            topic = hit.topic
            print(f"{topic}  {topics[topic].title}")
        print(f"    {hit.heading}: {hit.line}")
    if not topic:
        text = " ".join(readable(name, topics) for name in topics)
        written = sorted(set(re.findall(r"[a-z_]{3,}", text.lower())))
        raise ChoiceError(
            f'no paragraph of the guide has "{shortened(query)}"'
            + next(filter(None, (similar(word, written) for word in query.split())), "")
        )
