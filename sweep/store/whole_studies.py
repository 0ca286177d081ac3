"""Renaming and removal of a whole study while nobody launches it.

A study exists as long as its plan does. In a folder it is renamed in one step. In an
object store it is copied, its plan last, and then deleted, its plan first. Whatever
crashes, there is a whole study, and the same command resumes with the rest.
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
    """Return the place of what is stored of a study.

    Raises ChoiceError for what is no name of one, and StoreError if nothing of it is
    stored.
    """
    if not STUDY_NAME.fullmatch(study):
        raise ChoiceError(why_no_name(study))
    place = place_of(results / study, results)
    if not place.content():
        raise no_study(place.root, results)
    return place


def trials_in(place: StudyPlace) -> int:
    """Return how many trials the parts hold, also damaged ones, as far as they say."""
    return sum(trials_of(part) or 0 for part in place.parts())


def rename_study(study: str, name: str, results: Location) -> Location:
    """Give a study another name, and return its place.

    Its tables stay as they are, to the byte: their origin has the name under which the
    study was launched.

    Parameters
    ----------
    study : str
        Name of the study.
    name : str
        Its new name.
    results : Location
        Folder of stored studies.

    Raises
    ------
    ChoiceError
        If one of them is no name of a study.
    StoreError
        If there is no such study, something has the new name already, or somebody
        launches
        one of the two.
    """
    if why := why_no_name(name):
        raise ChoiceError(why)
    source = place_of_study(study, results)
    target = place_of(results / name, results)
    with Lock(source) as lock:
        if isinstance(target.root, Path):
            source.rename(target.root)
            # The claim has moved along with its folder.
            target.lock.withdraw(lock.token)
        else:
            with Lock(target):
                source.rename(target.root)
    return target.root


def remove_study(study: str, results: Location) -> list[str]:
    """Delete all that is stored of a study, and return the names of what remains there.

    Everything else in its place stays. Raises ChoiceError for what is no name of a
    study, and StoreError if there is none, somebody launches it, or something cannot be
    deleted.
    """
    place = place_of_study(study, results)
    with Lock(place):
        place.delete()
    return place.left()
