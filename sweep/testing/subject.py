"""The checked model, and the reference by which processes find the model."""

import importlib
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.model import Model
from sweep.errors import ChoiceError, CodeError
from sweep.own_code import MODEL, SUFFIX, OwnCode, gather, load, loaded, model_of
from sweep.spec import Setting, settings_of
from sweep.text import unknown


@dataclass(frozen=True)
class Subject:
    """A model with the catalogue that contains it.

    `reference` finds the model in another process, in the form that `subject` reads;
    a Model without a file has no reference. `refused` is the reason why studies cannot
    name the model of a file, or "".
    """

    model: Model
    catalogue: Catalogue
    reference: str = ""
    refused: str = ""

    @property
    def settings(self) -> dict[str, Setting]:
        """The parameters of the model by name."""
        return settings_of(self.model.name, self.catalogue)

    @property
    def travels(self) -> bool:
        """True if workers receive the model with a job."""
        return self.catalogue is BUILT_IN or bool(self.catalogue.runs)

    def variant(self, **fields: Any) -> "Subject":
        """Return the model with other values of some fields of Model."""
        model = self.model._replace(**fields)
        return replace(self, model=model, catalogue=entered(model), reference="")


def subject(model: Model | str | Path) -> Subject:
    """Return the subject of a model.

    `model` is a Model, the name of a registered model, or a reference: `vortex.py`,
    `vortex.py:NAME` or `package.module:NAME`. Raises ChoiceError for an unknown model,
    and CodeError for a file without a valid model.
    """
    if isinstance(model, Model):
        return _of_model(model)
    file, _, attribute = str(model).partition(":")
    if file.endswith(SUFFIX):
        return _of_file(Path(file), attribute or MODEL)
    if attribute:
        imported = getattr(importlib.import_module(file), attribute)
        return Subject(imported, entered(imported), str(model))
    if file not in BUILT_IN.models:
        raise ChoiceError(unknown("model", file, BUILT_IN.models))
    return Subject(BUILT_IN.models[file], BUILT_IN, file)


def _of_model(model: Model) -> Subject:
    """Return the subject of a Model.

    A reference needs a Model that is registered, or at the top of the module of its
    `advance`.
    """
    if BUILT_IN.models.get(model.name) is model:
        return Subject(model, BUILT_IN, model.name)
    module = sys.modules.get(model.advance.__module__)
    names = [name for name, member in vars(module).items() if member is model]
    reference = f"{model.advance.__module__}:{names[0]}" if names else ""
    return Subject(model, entered(model), reference)


def entered(model: Model) -> Catalogue:
    """Return the built-in catalogue with `model` as its only model."""
    models = {model.name: model}
    return replace(BUILT_IN, models=models)


def _of_file(path: Path, attribute: str) -> Subject:
    """Return the subject of the model in a file, even if studies cannot name it."""
    if not path.is_file():
        raise CodeError(f"{path}: no such file")
    sources = gather(path.parent, [path.name])
    module = load(sources, path.name)
    model = getattr(module, attribute, None)
    if not isinstance(model, Model):
        model = model_of(module, path.name, attribute)  # raises CodeError
    refused = ""
    try:
        catalogue: Catalogue = loaded(OwnCode(sources, ((path.name, attribute),)))
    except CodeError as error:
        catalogue = entered(model)
        refused = str(error)
    return Subject(model, catalogue, f"{path.resolve()}:{attribute}", refused)
