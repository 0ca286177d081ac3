"""An error that a model raises, as a sentence with file and line."""

from sweep.testing.places import of_error
from sweep.trial.numba_errors import explained


def sentence(error: Exception) -> str:
    """What an error says, and where in the files of the author it was raised."""
    if said := explained(error):
        return said
    place = of_error(error)
    where = f'{place}, "{place.code}": ' if place else ""
    first = str(error).partition("\n")[0]
    return f"{where}{type(error).__name__}: {first}"
