"""The model that is checked, and what other processes find it by."""

import importlib
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.model import Model
from sweep.errors import ChoiceError, CodeError
from sweep.own_code.catalogue import OwnCode, loaded
from sweep.own_code.entries import MODEL, model_of
from sweep.own_code.loading import load
from sweep.own_code.sources import SUFFIX, gather
from sweep.spec.settings import Setting, settings_of
from sweep.text import unknown


@dataclass(frozen=True)
class Subject:
    """A model with the catalogue in which it is entered.

    `reference` finds it in another process, as `subject` reads it; a Model that is in
    no file has none. `refused` says why studies cannot name the model of a file, if
    they cannot.
    """

    model: Model
    known: Catalogue
    reference: str = ""
    refused: str = ""

    @property
    def settings(self) -> dict[str, Setting]:
        return settings_of(self.model.name, self.known)

    @property
    def travels(self) -> bool:
        """Whether workers are given the model with a job."""
        return self.known is BUILT_IN or bool(self.known.runs)

    def variant(self, **fields: Any) -> "Subject":
        """The same model with other values of some fields of Model."""
        model = self.model._replace(**fields)
        return replace(self, model=model, known=entered(model), reference="")


def subject(model: Model | str | Path) -> Subject:
    """The subject of a Model, of the name of a registered one, or of a reference:
    `vortex.py`, `vortex.py:NAME` or `package.module:NAME`.

    Raises ChoiceError where there is no such model, and CodeError for a file of which
    none can be had.
    """
    if isinstance(model, Model):
        return _of_model(model)
    file, _, attribute = str(model).partition(":")
    if file.endswith(SUFFIX):
        return _of_file(Path(file), attribute or MODEL)
    if attribute:
        found = getattr(importlib.import_module(file), attribute)
        return Subject(found, entered(found), str(model))
    if file not in BUILT_IN.models:
        raise ChoiceError(unknown("model", file, BUILT_IN.models))
    return Subject(BUILT_IN.models[file], BUILT_IN, file)


def _of_model(model: Model) -> Subject:
    """The subject of a Model that is registered, or stands at the top of the module of
    its `advance`.
    """
    if BUILT_IN.models.get(model.name) is model:
        return Subject(model, BUILT_IN, model.name)
    module = sys.modules.get(model.advance.__module__)
    names = [name for name, one in vars(module).items() if one is model]
    reference = f"{model.advance.__module__}:{names[0]}" if names else ""
    return Subject(model, entered(model), reference)


def entered(model: Model) -> Catalogue:
    """The catalogue of ours in which `model` is the only model."""
    models = {model.name: model}
    return Catalogue(models, BUILT_IN.metrics, BUILT_IN.maps, BUILT_IN.starts)


def _of_file(path: Path, attribute: str) -> Subject:
    """The subject of the model in a file, be it one that studies can name or not."""
    if not path.is_file():
        raise CodeError(f"{path}: no such file")
    sources = gather(path.parent, [path.name])
    module = load(sources, path.name)
    model = getattr(module, attribute, None)
    if not isinstance(model, Model):
        model = model_of(module, path.name, attribute)  # raises CodeError
    reference, refused = f"{path.resolve()}:{attribute}", ""
    try:
        known: Catalogue = loaded(OwnCode(sources, ((path.name, attribute),)))
    except CodeError as error:
        known, refused = entered(model), str(error)
    return Subject(model, known, reference, refused)
