"""Renaming and removal of a whole study, under a lock that excludes launches.

A study exists as long as the plan exists. In a folder, a rename takes one step. In an
object store, a rename copies the study, the plan last, and then deletes the original,
the plan first. After any crash a whole study exists, and the repeated command resumes.
"""

from pathlib import Path

from sweep.errors import ChoiceError
from sweep.spec import STUDY_NAME, why_no_name
from sweep.store.finding import no_study
from sweep.store.locations import Location
from sweep.store.lock import Lock
from sweep.store.manifest import trials_of
from sweep.store.places import StudyPlace, place_of


def place_of_study(study: str, results: Location) -> StudyPlace:
    """Return the place of a stored study.

    Raises ChoiceError if `study` is not a name of a study, and StoreError if the study
    has no stored files.
    """
    if not STUDY_NAME.fullmatch(study):
        raise ChoiceError(why_no_name(study))
    place = place_of(results / study, results)
    if not place.content():
        raise no_study(place.root, results)
    return place


def trials_in(place: StudyPlace) -> int:
    """Return the number of trials in all parts, including damaged parts if known."""
    return sum(trials_of(part) or 0 for part in place.parts())


def rename_study(study: str, name: str, results: Location) -> Location:
    """Rename a study, and return the new location.

    The bytes of tables do not change. So the origin in the tables has the name under
    which the study was launched.

    Parameters
    ----------
    study : str
        Name of the study.
    name : str
        New name of the study.
    results : Location
        Folder of stored studies.

    Raises
    ------
    ChoiceError
        If `study` or `name` is not a name of a study.
    StoreError
        If no study has the old name, a study or folder has the new name, or another
        process launches either study.
    """
    if why := why_no_name(name):
        raise ChoiceError(why)
    source = place_of_study(study, results)
    target = place_of(results / name, results)
    with Lock(source) as lock:
        if isinstance(target.root, Path):
            source.rename(target.root)
            # The claim has moved with its folder.
            target.lock.withdraw(lock.token)
        else:
            with Lock(target):
                source.rename(target.root)
    return target.root


def remove_study(study: str, results: Location) -> list[str]:
    """Delete a stored study, and return the names of files that remain in its folder.

    Files that are not part of the study stay. Raises ChoiceError if `study` is not a
    name of a study. Raises StoreError if no such study is stored, another process
    launches the study, or a file cannot be deleted.
    """
    place = place_of_study(study, results)
    with Lock(place):
        place.delete()
    return place.left()
