"""Details: variants with other values of single parameters.

Each number that the specs of a publication do not vary is moved up and down by a small
and a large percentage. Each component of another preset of the model is tried alone.
"""

from collections import defaultdict
from collections.abc import Callable, Mapping
from functools import partial
from typing import cast

from sweep.published.publications import Publication
from sweep.published.variants import (
    Makers,
    SpecChange,
    Variant,
    altered,
    is_free,
    needed_studies,
    value_of,
)
from sweep.spec import (
    TORUS,
    WORLD,
    NotAllowedError,
    Setting,
    Study,
    Value,
    differing,
    fitted_preset,
)

PERCENTS = (2, 10)
WAYS = {"up": 1, "down": -1}

Moves = dict[str, Mapping[str, Value]]
"""By spec, the new values of parameters."""


def details(publication: Publication) -> Makers:
    """Return the details of a publication, such as `n-up-2` and `drag-of-as_run`.

    A variant with the values of an earlier variant is left out.
    """
    studies = needed_studies(publication)
    shifted = _shifted(studies)
    earlier = list[Moves]()
    makers: dict[str, Callable[[], Variant]] = {}
    for name, moves in (shifted | _of_other_presets(studies)).items():
        if moves not in earlier:
            earlier.append(moves)
            makers[name] = partial(
                altered,
                publication,
                kind="details",
                name=name,
                description=_description(studies, moves),
                changes={spec: SpecChange(values) for spec, values in moves.items()},
                share=_share(studies, moves) if name in shifted else None,
            )
    return makers


def moved(setting: Setting, value: float, percent: int) -> float:
    """Return a value moved by a percentage, within the bounds of its parameter.

    An integer moves by at least 1, unless it is 0, and otherwise by at most the
    percentage. The value is unchanged if no other value is allowed.

    Parameters
    ----------
    setting : Setting
        The parameter.
    value : float
        Present value.
    percent : int
        Percentage of the move; negative for a move down.
    """
    if setting.kind == "int":
        step = max(1, abs(int(value)) * abs(percent) // 100) if value else 0
        new = value + (step if percent > 0 else -step)
    else:
        new = value * (100 + percent) / 100
    try:
        return cast(float, setting.coerce(min(max(new, setting.low), setting.high)))
    except NotAllowedError:
        return value


def _numbers(study: Study) -> dict[str, float]:
    """Return the numbers that a study does not vary.

    The size of the world is left out if a map defines the size.
    """
    maps = {str(value) for axis in study.axes for value in axis.columns.get("map", ())}
    if is_free(study, "map"):
        maps.add(str(value_of(study, "map")))
    brought = WORLD if any(study.map_size(name) for name in maps) else ()
    return {
        name: cast(float, value_of(study, name))
        for name, setting in study.settings.items()
        if setting.kind in ("int", "float")
        and name not in brought
        and is_free(study, name)
    }


def _shifted(studies: Mapping[str, Study]) -> dict[str, Moves]:
    """Return each number moved, by the name of the variant.

    Moves without a change are left out.
    """
    moves_by_name: dict[str, Moves] = defaultdict(dict)
    for spec, study in studies.items():
        for name, value in _numbers(study).items():
            for percent in PERCENTS:
                for way, sign in WAYS.items():
                    new = moved(study.settings[name], value, sign * percent)
                    if new != value:
                        moves_by_name[f"{name}-{way}-{percent}"][spec] = {name: new}
    return moves_by_name


def _of_other_presets(studies: Mapping[str, Study]) -> dict[str, Moves]:
    """Return each component of another preset alone, by the name of the variant.

    Values in the spec are unchanged.
    """
    moves_by_name: dict[str, Moves] = defaultdict(dict)
    for spec, study in studies.items():
        in_spec = [name for name in study.settings if study.place_of(name)]
        before = fitted_preset(study.model, study.preset, study.catalogue)
        for preset in study.catalogue.models[study.model].presets:
            after = fitted_preset(study.model, preset, study.catalogue)
            for detail in differing(before, after, in_spec):
                values = {name: after[name] for name in detail}
                if values.get("borders") == TORUS and not after["minimum_image"]:
                    values["minimum_image"] = False
                moves_by_name[f"{detail[0]}-of-{preset}"][spec] = values
    return moves_by_name


def _share(studies: Mapping[str, Study], moves: Moves) -> float:
    """Return the largest fraction, over all specs, by which a number is moved."""
    shares = [
        abs(cast(float, new) / cast(float, value_of(studies[spec], name)) - 1.0)
        for spec, values in moves.items()
        for name, new in values.items()
    ]
    return round(max(shares), 6)


def _description(studies: Mapping[str, Study], moves: Moves) -> str:
    """Return the values before and after, such as `n 40 to 41`."""
    changes = {
        f"{name} {_plain(value_of(studies[spec], name))} to {_plain(new)}": None
        for spec, values in moves.items()
        for name, new in values.items()
    }
    return ", ".join(changes)


def _plain(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
