"""All mistakes of a spec in a single error.

A mistake in one key does not hide a mistake in a different key.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

from sweep.errors import SpecError

P = ParamSpec("P")
T = TypeVar("T")
MOST_MESSAGES = 20


class Mistakes:
    """A collection of SpecErrors, raised together.

    mistakes = Mistakes()
    for name, child in entry.mapping():
        with mistakes.noted():
            values[name] = read(child)
    mistakes.check()
    """

    def __init__(self) -> None:
        self._noted: list[SpecError] = []

    def __bool__(self) -> bool:
        return bool(self._noted)

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Note a SpecError that ends this block, and continue after the block."""
        try:
            yield
        except SpecError as error:
            self._noted += error.mistakes

    def note_common(self, several: "Sequence[Mistakes]") -> None:
        """Note mistakes at places where each of several readings has a mistake.

        The messages come from the first reading.
        """
        first, *further = several
        places = [{mistake.place for mistake in each._noted} for each in further]
        self._noted += [
            mistake
            for mistake in first._noted
            if all(mistake.place in wrong for wrong in places)
        ]

    def read(
        self, reader: Callable[P, T], *arguments: P.args, **named: P.kwargs
    ) -> T | None:
        """Return the result of `reader`, or None after a SpecError, which is noted."""
        with self.noted():
            return reader(*arguments, **named)
        return None

    def check(self) -> None:
        """Raise a SpecError with all noted mistakes, in the order of lines.

        A misspelt key is not also a missing key.
        """
        if not self._noted:
            return
        misspelt = {mistake.meant for mistake in self._noted if mistake.meant}
        noted = [mistake for mistake in self._noted if mistake.place not in misspelt]
        mistakes = sorted(noted, key=lambda mistake: mistake.line)
        messages = list(dict.fromkeys(map(str, mistakes)))
        if len(messages) == 1:
            raise mistakes[0]
        if len(messages) > MOST_MESSAGES:
            more = len(messages) - MOST_MESSAGES
            messages = [*messages[:MOST_MESSAGES], f"and {more:,} more mistakes"]
        raise SpecError("\n".join(messages), mistakes[0].line, mistakes)
