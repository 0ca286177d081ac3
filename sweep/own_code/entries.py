"""What a file of the user's own offers: a model, and tables of other entries.

A file has them under fixed names: MODEL, a Model; METRICS, MAPS, STARTS and SAMPLERS,
each a mapping from names to entries. Each is checked here, so that a spec can rely on
it.
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
from kernels.settings import UNITS, About
from kernels.starts import Start
from kernels.worlds import Map
from sweep.errors import CodeError
from sweep.own_code.names import undefined
from sweep.spec.derived_metrics import ENDINGS, NAME, TAKEN
from sweep.spec.evaluation import CONSTANTS, FUNCTIONS
from sweep.spec.sampling import Sampler
from sweep.spec.settings import GROUPS

T = TypeVar("T")
KINDS = (float, int, bool)
MODEL = "MODEL"
CHOICES = {"better": Better, "distribution": Distribution, "within": Range}
"""The fields of a metric that are one of some words."""


class Offered(NamedTuple):
    """The entries of one file, by name."""

    models: dict[str, Model]
    metrics: dict[str, Metric]
    maps: dict[str, Map]
    starts: dict[str, Start]
    samplers: dict[str, Sampler]


def nothing() -> Offered:
    """No entries yet."""
    return Offered({}, {}, {}, {}, {})


def offered(module: ModuleType, file: str, model: str | None) -> Offered:
    """What the module of a file offers; `model` is the name in it of the model that a
    spec asks for, if it asks for one.

    Raises CodeError for what is no such entry.
    """
    models = [] if model is None else [model_of(module, file, model)]
    found = Offered(
        {one.name: one for one in models},
        table_of(module, file, "METRICS", Metric),
        table_of(module, file, "MAPS", Map),
        table_of(module, file, "STARTS", Start),
        table_of(module, file, "SAMPLERS", Sampler),
    )
    stamped = found.models, found.metrics, found.maps, found.starts
    for name, entry in chain.from_iterable(table.items() for table in stamped):
        if fields := without_stamp(entry):
            raise CodeError(
                f"{file}: {_listed(fields)} of {name} is no function at the top of a"
                " file: only of those can an edit be noticed"
            )
        _check_functions(file, name, entry)
    for name, sampler in found.samplers.items():
        if sampler.blocks:
            raise CodeError(f'{file}: sampler "{name}" has blocks: only ours may')
    for name, metric in found.metrics.items():
        for field, choices in CHOICES.items():
            given = getattr(metric, field)
            if given is not None and given not in get_args(choices):
                raise CodeError(
                    f'{file}: metric "{name}" has {field}="{given}"; allowed:'
                    f" {_listed(get_args(choices))}"
                )
        if said := wrong_range(metric):
            raise CodeError(f'{file}: metric "{name}" {said}')
        if metric.unit not in UNITS:
            raise CodeError(
                f'{file}: metric "{name}" has the unit "{metric.unit}"; allowed:'
                f" {_listed(UNITS)}"
            )
    return found


def wrong_range(metric: Metric) -> str:
    """Why `low` and `high` of a metric are no range; "" where they are one."""
    low, high = ends = metric.low, metric.high
    if all(isinstance(end, int | float) for end in ends) and low < high:
        return ""
    return f"has low={low!r} and high={high!r}; allowed: two numbers, the lower first"


def model_of(module: ModuleType, file: str, attribute: str = MODEL) -> Model:
    """The model that a module has under a name. Raises CodeError where it is none, or
    where its settings or presets are not what specs can use.
    """
    model = getattr(module, attribute, None)
    if not isinstance(model, Model):
        there = [name for name, one in vars(module).items() if isinstance(one, Model)]
        found = f"it has {_listed(there)}" if there else "it has no Model"
        raise CodeError(f"{file}: {attribute} is no Model; {found}")
    check_name(file, "model", model.name)
    _check_settings(file, model)
    _check_presets(file, model)
    if said := flaw(model):
        raise CodeError(f"{file}: {model.name}: {said}")
    return model


def table_of(module: ModuleType, file: str, name: str, kind: type[T]) -> dict[str, T]:
    """The entries of a kind that a module has in a mapping, none if it has no such.

    Raises CodeError for what is no such mapping, and for names that cannot be.
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
    """Raise CodeError where the entry of a file cannot have this name."""
    if not (isinstance(name, str) and NAME.fullmatch(name)) or _is_word(name):
        raise CodeError(
            f'{file}: a {kind} cannot be called "{name}": a name has small letters,'
            " digits and _, begins with a letter, and is no word of expressions"
        )
    if kind == "metric" and (name.endswith(ENDINGS) or name in TAKEN):
        raise CodeError(
            f'{file}: a metric cannot be called "{name}": tables have columns of that'
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
"""What the functions of entries are called with. Those that draw a map or a start may
be partial.
"""
COMPILED = ("advance", "measure")
"""The functions that run in every step or frame."""


def _check_functions(file: str, name: str, entry: Any) -> None:
    """Raise CodeError for functions that read names which stand for nothing, for those
    that are not compiled and must be, and for those that take other arguments than they
    get.
    """
    for field in ARGUMENTS.keys() & set(entry._fields):
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
        wanted, taken = ARGUMENTS[field].split(", "), plain.__code__.co_argcount
        if taken != len(wanted):
            raise CodeError(
                f"{where}, the {field} of {name}, takes {taken} arguments, and gets"
                f" {len(wanted)}: {', '.join(wanted)}"
            )


def _check_settings(file: str, model: Model) -> None:
    """Raise CodeError unless each setting has a kind and an About."""
    params = model.params
    if not (isinstance(params, type) and hasattr(params, "_fields")):
        raise CodeError(f"{file}: params of {model.name} is no NamedTuple class")
    common = {name for _, group in GROUPS for name in group._fields}
    for name, hint in get_type_hints(params, include_extras=True).items():
        where = f'{file}: setting "{name}" of {model.name}'
        check_name(file, "setting", name)
        base, *extras = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        if base not in KINDS or not extras or not isinstance(extras[0], About):
            raise CodeError(
                f"{where} is written as Annotated[float, About(...)], with float, int"
                " or bool"
            )
        about = extras[0]
        if about.unit not in UNITS:
            raise CodeError(
                f'{where} has the unit "{about.unit}"; allowed: {_listed(UNITS)}'
            )
        if about.choices and base is not int:
            raise CodeError(f"{where} has choices, so it is an int: their index")
        if name in common or name in TAKEN:
            raise CodeError(f"{where} has a name that every model has, or every table")
    if "dt" not in params._fields:
        raise CodeError(f'{file}: {model.name} has no setting "dt", the time of a step')


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
