"""A stored study with those of its trials apart that nothing is averaged over."""

from typing import TypeVar

from sweep.method import methods
from sweep.tables.results import Results
from sweep.tables.stored_study import StoredStudy

Shown = TypeVar("Shown", bound=Results)


def keep_apart(study: Shown) -> Shown:
    """Return a study with the parts apart that its methods separate.

    The parts of joined studies are apart before they are joined. Raises StoreError if a
    table of the study lacks what tells its parts apart.
    """
    if isinstance(study, StoredStudy):
        for method in methods().values():
            study = method.keep_apart(study)
    return study
