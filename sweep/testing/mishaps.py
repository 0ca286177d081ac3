"""An error that a model raises, as a sentence with file and line."""

from sweep.testing.places import of_error
from sweep.trial import explained


def sentence(error: Exception) -> str:
    """Return the message of an error, with the raising line of the author."""
    if explanation := explained(error):
        return explanation
    place = of_error(error)
    where = f'{place}, "{place.code}": ' if place else ""
    first = str(error).partition("\n")[0]
    return f"{where}{type(error).__name__}: {first}"
