"""The promises that a launch tries of a model which is not built in, before its first
trial: where one of these is broken no trial fails, and all are wrong.
"""

from unittest import SkipTest

from kernels.identity import code_of
from kernels.models import MODELS
from sweep.spec.study import Study
from sweep.testing.calls import calls
from sweep.testing.grids import grid
from sweep.testing.reaching import reach
from sweep.testing.subject import Subject
from sweep.trial.probe import check_once

TRIED = {"calls": calls, "grid": grid, "reach": reach}


def check_promises(study: Study) -> None:
    """Try the model of a study with its preset, once for the same code.

    Raises SpecError, with the line of the model, for a broken promise. What the model
    raises in the small worlds of this check is no reason: a trial that raises fails.
    """
    name, known = study.model, study.known
    if name in MODELS and name not in MODELS.origins:
        return
    about = Subject(known.models[name], known)
    presets = {study.preset: about.model.presets[study.preset]}
    code = code_of(known, [(name, study.preset)], (), (), ())
    try:
        check_once(code, lambda: _try(about.variant(presets=presets)))
    except AssertionError as error:
        said = f"no trial runs, as the model breaks a promise: {error}"
        raise study.document.error(("model",), said) from None
    except Exception:
        return


def _try(about: Subject) -> None:
    """Raise AssertionError, with the name of the promise, for one that is broken."""
    for name, promise in TRIED.items():
        try:
            promise(about)
        except SkipTest:
            continue
        except AssertionError as error:
            raise AssertionError(f'"{name}" of sweep check: {error}') from None
