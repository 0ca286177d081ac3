"""What is said of entries without their code, as JSON: settings with units and ranges,
presets, metrics and their units. With it tables of a study can be read although nobody
has said that its code may run.
"""

import json
import math
from typing import Annotated, Any, NamedTuple, NoReturn, get_args, get_type_hints

from kernels.metrics import Metric
from kernels.model import Model, flaw
from kernels.settings import COMMON, About, Demand
from kernels.starts import GIVEN, Start
from kernels.worlds import Map
from sweep.errors import CodeError
from sweep.own_code.entries import CHOICES, KINDS, Offered, wrong_range

KIND = {kind.__name__: kind for kind in KINDS}
POTENTIAL = "pair_potential"


def description(own: Offered) -> dict[str, Any]:
    """What is said of entries, ready for JSON."""
    return {
        "models": {name: _of_model(model) for name, model in own.models.items()},
        "metrics": {name: _plain(one) for name, one in own.metrics.items()},
        "maps": {name: _plain(one) for name, one in own.maps.items()},
        "starts": {name: _of_start(one) for name, one in own.starts.items()},
    }


def _of_model(model: Model) -> dict[str, Any]:
    hints = get_type_hints(model.params, include_extras=True)
    settings = {
        name: {"kind": get_args(hint)[0].__name__} | _plain(get_args(hint)[1])
        for name, hint in hints.items()
    }
    return _plain(model) | {
        "settings": settings,
        "state": {name: _plain(about) for name, about in model.state.items()},
        POTENTIAL: model.pair_potential is not None,
    }


def _of_start(start: Start) -> dict[str, Any]:
    about = _plain(start)
    del about["by_replicate"]  # functions
    return about


def _plain(entry: Any) -> dict[str, Any]:
    """The fields of an entry that are no functions."""
    return {
        name: list(value) if isinstance(value, tuple) else value
        for name, value in entry._asdict().items()
        if not callable(value) and value is not None
    }


def described(text: str) -> Offered:
    """The entries of a description, without code: whatever asks them to compute raises
    CodeError. Raises ValueError for what describes none.
    """
    try:
        about = json.loads(text)
        return Offered(
            {name: _model(one) for name, one in about["models"].items()},
            {name: _metric(one) for name, one in about["metrics"].items()},
            {name: _map(one) for name, one in about["maps"].items()},
            {name: _start(one) for name, one in about["starts"].items()},
            samplers={},  # points are stored
        )
    except (TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ValueError(f"it describes no entries: {error}") from None


def _asleep(*_: object) -> NoReturn:
    """In the place of a function whose code was not asked to run."""
    raise CodeError("this needs the study's own code, which was not loaded")


def _model(about: dict[str, Any]) -> Model:
    fields = [(name, _hint(one)) for name, one in about.pop("settings").items()]
    params: Any = NamedTuple("Params", fields)  # type: ignore[misc]
    for demands in ("demands", "potential_demands"):
        about[demands] = _demands(about.get(demands, []))
    potential = _asleep if about.pop(POTENTIAL) else None
    about["metrics"] = tuple(about["metrics"])
    about["kinds"] = tuple(about["kinds"])
    # Settings that all models have came with later versions too.
    presets = about["presets"].items()
    about["presets"] = {name: COMMON | values for name, values in presets}
    about["vectors"] = tuple(map(tuple, about.get("vectors", ())))
    state = {name: _about(one) for name, one in about.pop("state").items()}
    model = Model(
        params=params,
        sight=_asleep,
        advance=_asleep,
        obstacle_reach=_asleep,
        goal_seekers=_asleep,
        pair_potential=potential,
        state=state,
        count_kinds=_asleep if about["kinds"] else None,
        **about,
    )
    if said := flaw(model):
        raise ValueError(said)
    return model


def _hint(about: dict[str, Any]) -> Any:
    return Annotated[KIND[about.pop("kind")], _about(about)]


def _about(about: dict[str, Any]) -> About:
    about["choices"] = tuple(about.get("choices", ()))
    if math.isnan(about["low"]) or math.isnan(about["high"]):
        raise ValueError("a bound is no number")
    return About(**about)


def _demands(stored: list[list[str]]) -> tuple[Demand, ...]:
    return tuple(Demand(str(condition), str(said)) for condition, said in stored)


def _metric(about: dict[str, Any]) -> Metric:
    demands = _demands(about.pop("demands", []))
    for read in ("state", "kinds"):
        about[read] = tuple(about[read])
    for field, choices in CHOICES.items():
        if field in about and about[field] not in get_args(choices):
            raise ValueError(f"a metric has {field}={about[field]!r}")
    metric = Metric(_asleep, demands=demands, **about)
    if said := wrong_range(metric):
        raise ValueError(f"a metric {said}")
    return metric


def _map(about: dict[str, Any]) -> Map:
    size = about.pop("size", None)
    drawn = (float(size[0]), float(size[1])) if size else None
    return Map(_asleep, size=drawn, **about)


def _start(about: dict[str, Any]) -> Start:
    demands = _demands(about.pop("demands", []))
    about.setdefault("random", about["text"] != GIVEN)  # not stored up to 0.18
    return Start(_asleep, demands=demands, **about)
