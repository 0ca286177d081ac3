"""The stored description of custom entries, as JSON.

The description has parameters with units and ranges, presets, and metrics with units.
The description makes the tables of a study readable without permission to run code.
"""

import json
import math
from typing import Annotated, Any, NamedTuple, NoReturn, get_args, get_type_hints

from kernels.metrics import Metric
from kernels.model import Event, Model, flaw
from kernels.profiles import Profile
from kernels.settings import COMMON, About, Demand
from kernels.starts import GIVEN, Start
from kernels.worlds import Map
from sweep.errors import CodeError
from sweep.own_code.entries import (
    CHOICES,
    KINDS,
    Offered,
    wrong_profile,
    wrong_range,
)

KIND = {kind.__name__: kind for kind in KINDS}
POTENTIAL = "pair_potential"


def description(own: Offered) -> dict[str, Any]:
    """Return the description of entries, ready for JSON.

    The description has no samplers, because the points of a study are stored.
    """
    profiles = {name: _plain(profile) for name, profile in own.profiles.items()}
    return {
        "models": {name: _of_model(model) for name, model in own.models.items()},
        "metrics": {name: _plain(metric) for name, metric in own.metrics.items()},
        "maps": {name: _plain(entry) for name, entry in own.maps.items()},
        "starts": {name: _of_start(start) for name, start in own.starts.items()},
        **({"profiles": profiles} if profiles else {}),
    }


def _of_model(model: Model) -> dict[str, Any]:
    hints = get_type_hints(model.params, include_extras=True)
    settings = {
        name: {"kind": get_args(hint)[0].__name__} | _plain(get_args(hint)[1])
        for name, hint in hints.items()
    }
    return _plain(model) | {
        "settings": settings,
        "state": {name: _plain(value) for name, value in model.state.items()},
        POTENTIAL: model.pair_potential is not None,
    }


def _of_start(start: Start) -> dict[str, Any]:
    fields = _plain(start)
    del fields["by_replicate"]  # functions
    return fields


def _plain(entry: Any) -> dict[str, Any]:
    """Return the fields of an entry, without functions."""
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in entry._asdict().items()
        if not callable(value) and value is not None
    }


def described(text: str) -> Offered:
    """Return the entries of a description, without code.

    All functions of the entries raise CodeError. Raises ValueError if the text, which
    is JSON, describes no entries.
    """
    try:
        stored = json.loads(text)
        return Offered(
            {name: _model(fields) for name, fields in stored["models"].items()},
            {name: _metric(fields) for name, fields in stored["metrics"].items()},
            {name: _map(fields) for name, fields in stored["maps"].items()},
            {name: _start(fields) for name, fields in stored["starts"].items()},
            samplers={},  # points are stored
            profiles={
                name: _profile(fields)
                for name, fields in stored.get("profiles", {}).items()
            },
        )
    except (TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ValueError(f"the description is not valid: {error}") from None


def _asleep(*_: object) -> NoReturn:
    """Raise CodeError, in place of a function whose code was not loaded."""
    raise CodeError("the custom code of the study is needed, but was not loaded")


def _model(fields: dict[str, Any]) -> Model:
    settings = fields.pop("settings")
    hints = [(name, _hint(setting)) for name, setting in settings.items()]
    params: Any = NamedTuple("Params", hints)  # type: ignore[misc]
    for demands in ("demands", "potential_demands"):
        fields[demands] = _demands(fields.get(demands, []))
    potential = _asleep if fields.pop(POTENTIAL) else None
    fields["metrics"] = tuple(fields["metrics"])
    fields["kinds"] = tuple(fields["kinds"])
    # Later versions added more parameters that all models have.
    presets = fields["presets"].items()
    fields["presets"] = {name: COMMON | values for name, values in presets}
    fields["events"] = tuple(map(Event.read, fields.get("events", ())))
    fields["vectors"] = tuple(map(tuple, fields.get("vectors", ())))
    state = {name: _about(value) for name, value in fields.pop("state").items()}
    model = Model(
        params=params,
        sight=_asleep,
        advance=_asleep,
        obstacle_reach=_asleep,
        goal_seekers=_asleep,
        pair_potential=potential,
        state=state,
        count_kinds=_asleep if fields["kinds"] else None,
        **fields,
    )
    if mistake := flaw(model):
        raise ValueError(mistake)
    return model


def _hint(fields: dict[str, Any]) -> Any:
    return Annotated[KIND[fields.pop("kind")], _about(fields)]


def _about(fields: dict[str, Any]) -> About:
    fields["choices"] = tuple(fields.get("choices", ()))
    if math.isnan(fields["low"]) or math.isnan(fields["high"]):
        raise ValueError("a bound is not a number")
    return About(**fields)


def _demands(stored: list[list[str]]) -> tuple[Demand, ...]:
    return tuple(Demand(str(condition), str(text)) for condition, text in stored)


def _metric(fields: dict[str, Any]) -> Metric:
    demands = _demands(fields.pop("demands", []))
    for read in ("state", "kinds"):
        fields[read] = tuple(fields[read])
    for field, choices in CHOICES.items():
        if field in fields and fields[field] not in get_args(choices):
            raise ValueError(f"a metric has {field}={fields[field]!r}")
    metric = Metric(_asleep, demands=demands, **fields)
    if mistake := wrong_range(metric):
        raise ValueError(f"a metric {mistake}")
    return metric


def _profile(fields: dict[str, Any]) -> Profile:
    profile = Profile(_asleep, **fields)
    if mistake := wrong_profile(profile):
        raise ValueError(f"a profile {mistake}")
    return profile


def _map(fields: dict[str, Any]) -> Map:
    stored = fields.pop("size", None)
    size = (float(stored[0]), float(stored[1])) if stored else None
    return Map(_asleep, size=size, **fields)


def _start(fields: dict[str, Any]) -> Start:
    demands = _demands(fields.pop("demands", []))
    fields.setdefault("random", fields["text"] != GIVEN)  # not stored up to 0.18
    return Start(_asleep, demands=demands, **fields)
