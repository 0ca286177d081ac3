"""The promises that a launch checks for a custom model, before the first trial.

A broken promise of this list makes no trial fail, but makes all results wrong.
"""

from unittest import SkipTest

from kernels.identity import code_of
from kernels.models import MODELS
from sweep.spec import Study
from sweep.testing.calls import calls
from sweep.testing.grids import grid
from sweep.testing.reaching import reach
from sweep.testing.subject import Subject
from sweep.trial import check_once

TRIED = {"calls": calls, "grid": grid, "reach": reach}


def check_promises(study: Study) -> None:
    """Check the model of a study with its preset, once per code.

    The checked promises are "calls", "grid" and "reach". A built-in model is not
    checked. The check ignores an exception of the model in the small test worlds,
    because a trial with an exception fails.

    Parameters
    ----------
    study : Study
        The study that `sweep.own_code.load_spec` reads.

    Raises
    ------
    SpecError
        If the model breaks a promise. The sentence names the line of the model in the
        spec, and the file, line and rule of the promise.

    Examples
    --------
    >>> from sweep.own_code import study_of
    >>> fixed = {"n": 10, "steps": 20}
    >>> spec = {"study": "my/vortex", "model": "./vortex.py", "fixed": fixed}
    >>> check_promises(study_of(spec | {"replicates": 2}))  # no error: they are kept
    """
    name = study.model
    catalogue = study.catalogue
    if name in MODELS and name not in MODELS.origins:
        return
    subject = Subject(catalogue.models[name], catalogue)
    presets = {study.preset: subject.model.presets[study.preset]}
    code = code_of(catalogue, [(name, study.preset)], (), (), starts=())
    try:
        check_once(code, lambda: _try(subject.variant(presets=presets)))
    except AssertionError as error:
        message = (
            f"no trial runs, because the model does not meet a requirement: {error}"
        )
        raise study.document.error(("model",), message) from None
    except Exception:
        return


def _try(subject: Subject) -> None:
    """Raise AssertionError for a broken promise, with the name of the promise."""
    for name, promise in TRIED.items():
        try:
            promise(subject)
        except SkipTest:
            continue
        except AssertionError as error:
            raise AssertionError(f'"{name}" of sweep check: {error}') from None
