"""All mistakes of a spec in one answer: what is wrong in one place does not hide what
is wrong in another.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import ParamSpec, TypeVar

from sweep.errors import SpecError

P = ParamSpec("P")
T = TypeVar("T")
MOST_SAID = 20


class Mistakes:
    """Gathers SpecErrors:

    mistakes = Mistakes()
    for name, child in entry.mapping():
        with mistakes.noted():
            found[name] = read(child)
    mistakes.check()
    """

    def __init__(self) -> None:
        self._found: list[SpecError] = []

    def __bool__(self) -> bool:
        return bool(self._found)

    @contextmanager
    def noted(self) -> Iterator[None]:
        """A SpecError that ends this block is noted, and what follows goes on."""
        try:
            yield
        except SpecError as error:
            self._found += error.mistakes

    def note_common(self, several: "Sequence[Mistakes]") -> None:
        """Note what is wrong in each of several readings, at the same place: as the
        first of them says it.
        """
        first, *others = several
        places = [{one.place for one in other._found} for other in others]
        self._found += [
            one for one in first._found if all(one.place in found for found in places)
        ]

    def read(
        self, reader: Callable[P, T], *arguments: P.args, **named: P.kwargs
    ) -> T | None:
        """What `reader` returns; None where it raises a SpecError, which is noted."""
        with self.noted():
            return reader(*arguments, **named)
        return None

    def check(self) -> None:
        """Raise one SpecError with all that was noted, in the order of lines."""
        if not self._found:
            return
        found = sorted(self._found, key=lambda mistake: mistake.line)
        said = list(dict.fromkeys(map(str, found)))
        if len(said) == 1:
            raise found[0]
        if len(said) > MOST_SAID:
            more = len(said) - MOST_SAID
            said = [*said[:MOST_SAID], f"and {more:,} more mistakes"]
        raise SpecError("\n".join(said), found[0].line, found)
