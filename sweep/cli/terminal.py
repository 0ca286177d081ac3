"""Tables and lines in a terminal, by rich."""

from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from sweep.cli.output import spelled
from sweep.text import harmless

PIPE_WIDTH = 200


class Terminal(Console):
    """A rich console that prints every text as data.

    Text is made harmless; markup and emoji codes have no effect.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__(markup=False, emoji=False, highlight=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a text harmless, and spell characters that the encoding lacks.

        rich calls this method for every printed text, including the cells of tables,
        before rich decides on widths.
        """
        shown = spelled(harmless(text), self.encoding)
        return super().render_str(shown, **options)

    def print(self, *objects: Any, **options: Any) -> None:
        """Print like rich, but with the caption of a table on separate lines.

        rich would wrap the caption to the width of the table.
        """
        match objects:
            case [Table(caption=str(caption)) as table]:
                table.caption = None
                super().print(table, **options)
                super().print(caption, style="table.caption", soft_wrap=True)
                table.caption = caption
            case _:
                super().print(*objects, **options)


def console() -> Terminal:
    """Return a console for standard output, wide enough in a pipe for all columns."""
    out = Terminal()
    return out if out.is_terminal else Terminal(width=PIPE_WIDTH)
