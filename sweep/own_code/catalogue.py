"""A catalogue with the entries of custom code."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain
from pathlib import PurePosixPath
from threading import RLock
from types import MappingProxyType
from typing import Any, TypeVar

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.metrics.parts import OF, of_part
from kernels.model import Model, Sight
from kernels.profiles import of_part as profile_of_part
from kernels.registry import Registry
from sweep.errors import CodeError
from sweep.own_code.description import described, description
from sweep.own_code.entries import MODEL, Offered, check_name, nothing, offered
from sweep.own_code.installed import Installed, installed_module
from sweep.own_code.loading import load
from sweep.own_code.places import read_places
from sweep.own_code.sources import SUFFIX, Sources
from sweep.recordings import SUFFIX as RECORDING_SUFFIX
from sweep.recordings import as_model
from sweep.spec import (
    GROUPS,
    SAMPLERS,
    NotAllowedError,
    Sampler,
    preset_settings,
    settings_of,
    settings_tuple,
)
from sweep.text import unknown

T = TypeVar("T")
CATALOGUED = ("models", "metrics", "maps", "starts", "profiles")
"""The kinds of entries that compute trials, which a catalogue has."""
REGISTRIES: dict[str, Registry[Any]] = {
    kind: getattr(BUILT_IN, kind) for kind in CATALOGUED
} | {"samplers": SAMPLERS}
_LOCK = RLock()
COMMON = {name for _, group in GROUPS for name in group._fields}
"""Names of the parameters that every model has."""


@dataclass(frozen=True)
class OwnCode:
    """The custom code of a spec: named files, all imported files, and modules.

    Attributes
    ----------
    sources : Sources
        Files that the spec names, and all imported files.
    named : tuple of (str, str or None)
        Path of each named file, or name of each module of a package; with the name of
        the model that the spec takes from it, or None.
    packages : tuple of Installed
        Packages of the modules.
    folder : str, default "."
        Path from the folder of the spec to the folder of the files.
    """

    sources: Sources
    named: tuple[tuple[str, str | None], ...]
    packages: tuple[Installed, ...] = ()
    folder: str = "."

    @cached_property
    def sha(self) -> str:
        """The sha256 of the code, and of the names that a spec takes from the code."""
        more = [self.packages] if self.packages else []
        content = json.dumps([self.sources.files, self.named, *more])
        return hashlib.sha256(content.encode()).hexdigest()

    @property
    def runs(self) -> tuple[str, ...]:
        """Files and modules of packages that run."""
        modules = [name for name, _ in self.named if self.package_of(name)]
        return (*self.sources.code, *modules)

    def package_of(self, name: str) -> Installed | None:
        """Return the package of a named module; None for a file."""
        if name in self.sources.texts:
            return None
        first = name.partition(".")[0]
        packages = (package for package in self.packages if package.name == first)
        return next(packages, None)


class _Joined(Mapping[str, T]):
    """Built-in entries and custom entries. Custom entries come first in a look-up."""

    def __init__(self, ours: Mapping[str, T], own: Mapping[str, T]) -> None:
        self._ours = ours
        self._own = own

    def __getitem__(self, name: str) -> T:
        return self._own[name] if name in self._own else self._ours[name]

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._ours

    def __iter__(self) -> Iterator[str]:
        return chain(self._ours, self._own)

    def __len__(self) -> int:
        return len(self._ours) + len(self._own)


class _JoinedParts(_Joined[T]):
    """Built-in and custom metrics or profiles, also of parts of the boids of `models`.

    `of_part` returns the entry of a part of the boids from a name, or None.
    """

    def __init__(
        self,
        ours: Mapping[str, T],
        own: Mapping[str, T],
        models: Mapping[str, Model],
        of_part: Callable[[str, Mapping[str, T], Iterable[str]], T | None],
    ) -> None:
        super().__init__(ours, own)
        self._models = models
        self._named = of_part

    def __getitem__(self, name: str) -> T:
        return self._of_part(name) or super().__getitem__(name)

    def __contains__(self, name: object) -> bool:
        listed = super().__contains__(name)
        return listed or (isinstance(name, str) and self._of_part(name) is not None)

    def _of_part(self, name: str) -> T | None:
        """Return the entry of a part; None for a listed name, or an unknown one."""
        if OF not in name or super().__contains__(name):
            return None
        kinds = (kind for model in self._models.values() for kind in model.kinds)
        return self._named(name, _Joined(self._ours, self._own), kinds)


def _joined(catalogue: Catalogue, own: Offered) -> list[Any]:
    """Return the mappings of a catalogue with more entries."""
    models = _Joined(catalogue.models, own.models)
    metrics = _JoinedParts(catalogue.metrics, own.metrics, models, of_part)
    maps = _Joined(catalogue.maps, own.maps)
    starts = _Joined(catalogue.starts, own.starts)
    profiles = _JoinedParts(catalogue.profiles, own.profiles, models, profile_of_part)
    return [models, metrics, maps, starts, profiles]


def completed(catalogue: Catalogue, stored: Mapping[str, Any]) -> Catalogue:
    """Return the catalogue, completed with described entries that are missing.

    An entry is missing if the package of the entry is not installed. Raises ValueError
    if `stored` is no description of entries.
    """
    offers = described(json.dumps(stored))
    missing = nothing()
    for kind in CATALOGUED:
        for name, entry in getattr(offers, kind).items():
            if name not in _of(catalogue, kind):
                getattr(missing, kind)[name] = entry
    return Catalogue(*_joined(catalogue, missing)) if any(missing) else catalogue


def of_packages(
    catalogue: Catalogue, names: Mapping[str, Iterable[str]]
) -> dict[str, Any]:
    """Return the stored description of the entries that come from installed packages.

    The description is empty if all entries are built in. `names` are the names of the
    entries that a study uses, by kind.
    """
    used = nothing()
    for kind, some in names.items():
        for name in some:
            if name in REGISTRIES[kind].origins:
                getattr(used, kind)[name] = _of(catalogue, kind)[name]
    return description(used) if any(used) else {}


def _of(catalogue: Catalogue, kind: str) -> Mapping[str, Any]:
    entries: Mapping[str, Any] = getattr(catalogue, kind)
    return entries


class OwnCatalogue(Catalogue):
    """The catalogue of a study with custom code.

    Attributes
    ----------
    code : OwnCode
    own : Offered
        Entries of the code.
    origins : mapping of (str, str) to str
        File or module of each entry, by its kind and name.
    """

    code: OwnCode
    own: Offered
    origins: Mapping[tuple[str, str], str]

    def __init__(
        self,
        code: OwnCode,
        own: Offered,
        origins: Mapping[tuple[str, str], str] = MappingProxyType({}),
    ) -> None:
        super().__init__(*_joined(BUILT_IN, own))
        object.__setattr__(self, "code", code)
        object.__setattr__(self, "own", own)
        object.__setattr__(self, "origins", origins)

    @property
    def runs(self) -> tuple[str, ...]:
        """Files and modules of packages that run."""
        return self.code.runs

    def written(self, kind: str, name: str, /) -> str:
        """Return an entry as a spec writes it, such as ``./vortex.py``.

        Parameters
        ----------
        kind : str
            Kind of the entry, such as ``models``.
        name : str
            Name in the catalogue. A built-in entry is written by that name.
        """
        origin = self.origins.get((kind, name))
        if origin is None:
            return name
        attribute = dict(self.code.named)[origin] if kind == "models" else name
        if self.code.package_of(origin):
            return f"{origin}:{attribute}"
        path = (PurePosixPath(self.code.folder) / origin).as_posix()
        path = path if path.startswith("..") else f"./{path}"
        alone = attribute == MODEL or not origin.endswith(SUFFIX)
        return path if alone else f"{path}:{attribute}"

    def __reduce__(self) -> tuple[object, ...]:
        return loaded, (self.code,)

    @property
    def samplers(self) -> Mapping[str, Sampler]:
        """All samplers of points, built-in and custom."""
        return _Joined(SAMPLERS, self.own.samplers)

    @cached_property
    def description(self) -> dict[str, Any]:
        """Stored description of the custom entries, ready for JSON."""
        return description(self.own)


def loaded(code: OwnCode) -> OwnCatalogue:
    """Return the catalogue with the entries of the code.

    The code runs once per process; a second call with equal code returns the first
    object. Raises CodeError, which names the file, for an entry that cannot be used,
    and for a name that is taken already.
    """
    with _LOCK:
        return _loaded(code)


@lru_cache(maxsize=64)
def _loaded(code: OwnCode) -> OwnCatalogue:
    own = nothing()
    origins = dict[tuple[str, str], str]()
    for file, model in code.named:
        with _of_file(file):
            offers = _offers_of(code, file, model)
            for kind, entries in offers._asdict().items():
                for name in entries:
                    _enter(kind, name, file, origins)
                getattr(own, kind).update(entries)
    catalogue = OwnCatalogue(code, own, origins)
    for name in own.models:
        _check_model(origins["models", name], name, catalogue)
        _check_sight(origins["models", name], name, catalogue)
    return catalogue


def _offers_of(code: OwnCode, file: str, model: str | None) -> Offered:
    if package := code.package_of(file):
        return offered(installed_module(file, package), file, model)
    if file in code.sources.code:
        return offered(load(code.sources, file), file, model)
    name = PurePosixPath(file).stem
    offers = nothing()
    if file.endswith(RECORDING_SUFFIX):
        try:
            offers.models[name] = as_model(code.sources.texts[file])
        except ValueError as error:
            raise CodeError(f"{file}: {error}") from None
        return offers
    check_name(file, "start", name)
    offers.starts[name] = read_places(file, code.sources.texts[file])
    return offers


@contextmanager
def _of_file(file: str) -> Iterator[None]:
    """Add the file of the spec to the message of an error."""
    try:
        yield
    except CodeError as error:
        raise CodeError(error.reason, file) from error


def check_free(file: str, kind: str, name: str) -> None:
    """Raise CodeError if a name is taken without any custom code.

    Parameters
    ----------
    file : str
        Name of the file in the message.
    kind : str
        Kind of the entry, such as ``models``.
    name : str
        Name of the entry.
    """
    if name in REGISTRIES[kind]:
        origin = REGISTRIES[kind].origins.get(name)
        whose = f"of {origin}" if origin else "built in"
        raise CodeError(
            f'{file}: the {kind[:-1]} "{name}" is {whose}: give the custom'
            f" {kind[:-1]} another name"
        )
    if kind == "profiles" and name in REGISTRIES["metrics"]:
        raise CodeError(f'{file}: there is a metric "{name}" already')
    if kind == "metrics" and name in COMMON:
        raise CodeError(f'{file}: there is a parameter "{name}" already')


def _enter(
    kind: str, name: str, file: str, origins: dict[tuple[str, str], str]
) -> None:
    """Note the file of a name. Raises CodeError if the name is taken."""
    check_free(file, kind, name)
    earlier = origins.setdefault((kind, name), file)
    if earlier != file:
        raise CodeError(f'{file}: {earlier} also has a {kind[:-1]} "{name}"')


def _check_model(file: str, name: str, catalogue: OwnCatalogue) -> None:
    """Raise CodeError for a model with wrong metrics, parameters or presets."""
    model = catalogue.models[name]
    for metric in model.metrics:
        if metric not in catalogue.metrics:
            raise CodeError(f"{file}: {unknown('metric', metric, catalogue.metrics)}")
    settings = settings_of(name, catalogue)
    for taken in settings.keys() & catalogue.metrics.keys():
        raise CodeError(
            f'{file}: a parameter of {name} and a metric have the name "{taken}":'
            " tables have one column per name"
        )
    for preset in model.presets:
        values = model.preset_values(preset)
        for parameter, setting in settings.items():
            try:
                setting.coerce(values[parameter])
            except NotAllowedError as error:
                raise CodeError(f'{file}: preset "{preset}": {error}') from None


def _check_sight(file: str, name: str, catalogue: OwnCatalogue) -> None:
    """Raise CodeError if `sight` of a model returns no Sight, or raises."""
    model = catalogue.models[name]
    settings = settings_of(name, catalogue)
    for preset in model.presets:
        values = preset_settings(name, preset, catalogue)
        params = settings_tuple(model.params, values, settings)
        try:
            sight = model.sight(params)
        except Exception as error:
            message = f"{type(error).__name__}: {error}"
            raise CodeError(f"{file}: sight of {name}, {preset}: {message}") from error
        if not isinstance(sight, Sight):
            raise CodeError(
                f"{file}: sight of {name} returns {sight!r}; allowed: a Sight"
            )


@lru_cache(maxsize=64)
def unloaded(code: OwnCode, text: str) -> OwnCatalogue:
    """Return the catalogue of stored code, which does not run.

    The entries are read from a stored description, `text`, in JSON. All functions
    of entries raise CodeError. Raises ValueError if the description is not valid.
    """
    own = described(text)
    for kind, entries in own._asdict().items():
        if taken := entries.keys() & REGISTRIES[kind].keys():
            raise ValueError(f"built-in {kind} have the names {', '.join(taken)}")
    catalogue = OwnCatalogue(code, own)
    try:
        for kind, entries in own._asdict().items():
            for name in entries:
                check_name("it", kind[:-1], name)
        for name in own.models:
            _check_model("it", name, catalogue)
    except (CodeError, TypeError, KeyError, AttributeError) as error:
        raise ValueError(f"the description is not valid: {error}") from None
    return catalogue
