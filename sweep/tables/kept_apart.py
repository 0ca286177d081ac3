"""A stored study whose parts are apart where no average is allowed."""

from typing import TypeVar

from sweep.method import methods
from sweep.tables.results import Results
from sweep.tables.stored_study import StoredStudy

Shown = TypeVar("Shown", bound=Results)


def keep_apart(study: Shown) -> Shown:
    """Return a study with the parts apart that methods separate.

    The parts of joined studies are separated before the studies are joined. Raises
    StoreError if a table of the study lacks the column that separates the parts.
    """
    if isinstance(study, StoredStudy):
        for method in methods().values():
            study = method.keep_apart(study)
    return study
