"""The entries that a file of custom code offers: a model, and tables of other entries.

The names of the tables are fixed: MODEL is a Model; METRICS, MAPS, STARTS, PROFILES and
SAMPLERS are mappings from names to entries. This module checks every entry, so that a
spec can rely on the entries.
"""

import keyword
from collections.abc import Mapping
from itertools import chain
from types import FunctionType, ModuleType
from typing import (
    Annotated,
    Any,
    NamedTuple,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
)

from kernels.identity import is_compiled, without_stamp
from kernels.metrics import Better, Distribution, Metric, Range
from kernels.model import Model, flaw
from kernels.profiles import PROFILE_UNITS, Axis, Profile
from kernels.settings import UNITS, About
from kernels.starts import Start
from kernels.worlds import Map
from sweep.errors import CodeError
from sweep.own_code.names import undefined
from sweep.spec import CONSTANTS, ENDINGS, FUNCTIONS, GROUPS, NAME, TAKEN, Sampler

T = TypeVar("T")
KINDS = (float, int, bool)
MODEL = "MODEL"
CHOICES = {"better": Better, "distribution": Distribution, "within": Range}
"""Fields of a metric with a fixed list of allowed words, and the words."""


class Offered(NamedTuple):
    """The entries of one file, by name."""

    models: dict[str, Model]
    metrics: dict[str, Metric]
    maps: dict[str, Map]
    starts: dict[str, Start]
    samplers: dict[str, Sampler]
    profiles: dict[str, Profile]


def nothing() -> Offered:
    """Return an Offered without entries, to be filled."""
    return Offered(models={}, metrics={}, maps={}, starts={}, samplers={}, profiles={})


def offered(module: ModuleType, file: str, model: str | None) -> Offered:
    """Return the entries that the module of a file offers.

    Parameters
    ----------
    module : ModuleType
        Module of the file.
    file : str
        Name of the file in messages.
    model : str or None
        Name in the module of the model that a spec asks for; None for no model.

    Raises
    ------
    CodeError
        If an entry cannot be used.
    """
    models = [] if model is None else [model_of(module, file, model)]
    offers = Offered(
        models={model.name: model for model in models},
        metrics=table_of(module, file, "METRICS", Metric),
        maps=table_of(module, file, "MAPS", Map),
        starts=table_of(module, file, "STARTS", Start),
        samplers=table_of(module, file, "SAMPLERS", Sampler),
        profiles=table_of(module, file, "PROFILES", Profile),
    )
    stamped = (
        *(offers.models, offers.metrics, offers.maps, offers.starts),
        offers.profiles,
    )
    for name, entry in chain.from_iterable(table.items() for table in stamped):
        if fields := without_stamp(entry):
            raise CodeError(
                f"{file}: {_listed(fields)} of {name} is no function at the top of a"
                " file: edits of other functions cannot be detected"
            )
        _check_functions(file, name, entry)
    for name, sampler in offers.samplers.items():
        if sampler.blocks:
            raise CodeError(
                f'{file}: sampler "{name}" has blocks: only built-in samplers may'
            )
    for name, profile in offers.profiles.items():
        if mistake := wrong_profile(profile):
            raise CodeError(f'{file}: profile "{name}" {mistake}')
    for name, metric in offers.metrics.items():
        for field, choices in CHOICES.items():
            word = getattr(metric, field)
            if word is not None and word not in get_args(choices):
                raise CodeError(
                    f'{file}: metric "{name}" has {field}="{word}"; allowed:'
                    f" {_listed(get_args(choices))}"
                )
        if mistake := wrong_range(metric):
            raise CodeError(f'{file}: metric "{name}" {mistake}')
        if metric.unit not in UNITS:
            raise CodeError(
                f'{file}: metric "{name}" has the unit "{metric.unit}"; allowed:'
                f" {_listed(UNITS)}"
            )
    return offers


def wrong_profile(profile: Profile) -> str:
    """Return an error in the fields of a profile, or ""."""
    axes = get_args(Axis)
    if profile.axis not in axes:
        return f'has the axis "{profile.axis}"; allowed: {_listed(axes)}'
    if profile.unit not in PROFILE_UNITS:
        return f'has the unit "{profile.unit}"; allowed: {_listed(PROFILE_UNITS)}'
    if not isinstance(profile.exponent, int | float):
        return f"has exponent={profile.exponent!r}; allowed: a number"
    return wrong_range(profile)


def wrong_range(metric: Metric | Profile) -> str:
    """Return why `low` and `high` are no range; "" for a valid range."""
    low = metric.low
    high = metric.high
    if all(isinstance(end, int | float) for end in (low, high)) and low < high:
        return ""
    return f"has low={low!r} and high={high!r}; allowed: two numbers, the lower first"


def model_of(module: ModuleType, file: str, attribute: str = MODEL) -> Model:
    """Return the model with a given name in a module.

    Parameters
    ----------
    module : ModuleType
    file : str
        Name of the file in messages.
    attribute : str, default "MODEL"
        Name of the model in the module.

    Raises
    ------
    CodeError
        If there is no model of that name, or specs cannot use its parameters or
        presets.
    """
    model = getattr(module, attribute, None)
    if not isinstance(model, Model):
        values = vars(module).items()
        names = [name for name, value in values if isinstance(value, Model)]
        hint = f"the file has {_listed(names)}" if names else "the file has no Model"
        raise CodeError(f"{file}: {attribute} is no Model; {hint}")
    check_name(file, "model", model.name)
    _check_settings(file, model)
    _check_presets(file, model)
    if mistake := flaw(model):
        raise CodeError(f"{file}: {model.name}: {mistake}")
    return model


def table_of(module: ModuleType, file: str, name: str, kind: type[T]) -> dict[str, T]:
    """Return the entries of one kind from a mapping in a module.

    Parameters
    ----------
    module : ModuleType
    file : str
        Name of the file in messages.
    name : str
        Name of the mapping in the module, such as ``METRICS``. A module without it has
        no entries of that kind.
    kind : type
        Type of the entries.

    Raises
    ------
    CodeError
        If `name` is no such mapping, or an entry has a name that is not allowed.
    """
    table = getattr(module, name, {})
    if not isinstance(table, Mapping):
        raise CodeError(f"{file}: {name} is no mapping from names to {kind.__name__}")
    for key, entry in table.items():
        check_name(file, kind.__name__.lower(), key)
        if not isinstance(entry, kind):
            raise CodeError(f'{file}: {name}["{key}"] is no {kind.__name__}')
    return dict(table)


def check_name(file: str, kind: str, name: object) -> None:
    """Raise CodeError if the entry of a file may not have a name.

    Parameters
    ----------
    file : str
        Name of the file in messages.
    kind : str
        Kind of the entry in words, such as ``metric``.
    name : object
        Name of the entry; an error if it is no string.
    """
    if not (isinstance(name, str) and NAME.fullmatch(name)) or _is_word(name):
        raise CodeError(
            f'{file}: a {kind} cannot be called "{name}"; allowed: lower-case letters,'
            " digits and _, with a letter first, but no word of expressions"
        )
    if kind == "metric" and (name.endswith(ENDINGS) or name in TAKEN):
        raise CodeError(
            f'{file}: a metric cannot be called "{name}": tables have a column of that'
            " name"
        )


def _is_word(name: str) -> bool:
    return name in (*CONSTANTS, *FUNCTIONS, *keyword.kwlist)


ARGUMENTS = {
    "advance": "flock, world, params, work, record, rng, steps",
    "sight": "params",
    "obstacle_reach": "params",
    "goal_seekers": "params, n",
    "begin_state": "params, flock, kind, rng, state",
    "count_kinds": "params, n",
    "measure": "frames, filled, ground, observation, values",
}
"""Arguments of the functions of entries.

Functions that draw a map or a start may be partial.
"""
OF_PROFILES = {"measure": "passage, axis, values"}
"""Arguments of the functions of profiles."""
COMPILED = ("advance", "measure")
"""The functions that run in every step or frame."""


def _check_functions(file: str, name: str, entry: Any) -> None:
    """Raise CodeError for a function that cannot be used.

    Such a function reads an undefined name, is not compiled though it must be, or takes
    the wrong number of arguments.
    """
    expected = OF_PROFILES if isinstance(entry, Profile) else ARGUMENTS
    for field in expected.keys() & set(entry._fields):
        function = getattr(entry, field)
        plain = getattr(function, "py_func", function)
        if function is None or not isinstance(plain, FunctionType):
            continue
        for wrong in undefined(plain):
            own = wrong.file.partition("/")[2] or wrong.file
            raise CodeError(f"{own}, line {wrong.line}, {wrong.words}")
        line = plain.__code__.co_firstlineno
        where = f"{file}, line {line}: {plain.__name__}"
        if field in COMPILED and not is_compiled(function):
            raise CodeError(f"{where} is not compiled: write @jit above it")
        arguments = expected[field].split(", ")
        taken = plain.__code__.co_argcount
        if taken != len(arguments):
            raise CodeError(
                f"{where}, the {field} of {name}, takes {taken} arguments, but gets"
                f" {len(arguments)}: {', '.join(arguments)}"
            )


def _check_settings(file: str, model: Model) -> None:
    """Raise CodeError unless each parameter has a kind and an About."""
    params = model.params
    if not (isinstance(params, type) and hasattr(params, "_fields")):
        raise CodeError(f"{file}: params of {model.name} is no NamedTuple class")
    common = {name for _, group in GROUPS for name in group._fields}
    for name, hint in get_type_hints(params, include_extras=True).items():
        where = f'{file}: parameter "{name}" of {model.name}'
        check_name(file, "setting", name)
        base, *extras = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        if base not in KINDS or not extras or not isinstance(extras[0], About):
            raise CodeError(
                f"{where} must be written as Annotated[float, About(...)], with float,"
                " int or bool"
            )
        setting = extras[0]
        if setting.unit not in UNITS:
            raise CodeError(
                f'{where} has the unit "{setting.unit}"; allowed: {_listed(UNITS)}'
            )
        if setting.choices and base is not int:
            raise CodeError(f"{where} has choices: write int, the index of a choice")
        if name in common or name in TAKEN:
            raise CodeError(f"{where} has a name that every model or table already has")
    if "dt" not in params._fields:
        raise CodeError(
            f'{file}: {model.name} has no parameter "dt", the time of a step'
        )


def _check_presets(file: str, model: Model) -> None:
    if not model.presets:
        raise CodeError(f"{file}: {model.name} has no preset")
    names = [name for _, group in GROUPS for name in group._fields]
    for preset in model.presets:
        values = model.preset_values(preset)
        missing = [
            name for name in (*model.params._fields, *names) if name not in values
        ]
        if missing:
            raise CodeError(
                f'{file}: preset "{preset}" of {model.name} has no {_listed(missing)}'
                " (COMMON has what most models share)"
            )


def _listed(names: Any) -> str:
    return ", ".join(f'"{name}"' for name in names)
