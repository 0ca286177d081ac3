"""A stored study with those of its trials apart that nothing is averaged over."""

from sweep.method import methods
from sweep.tables.stored_study import StoredStudy


def keep_apart(study: StoredStudy) -> StoredStudy:
    """Return a study with the parts apart that its methods separate.

    Raises StoreError if a table of the study lacks what tells its parts apart.
    """
    for method in methods().values():
        study = method.keep_apart(study)
    return study
