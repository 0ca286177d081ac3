"""Details: variants with other values of single settings.

Each number that the specs of a publication do not vary is moved up and down by a small
and a large share, and each detail of the other presets of the model is tried alone.
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
from sweep.spec.ablation import WORLD, differing, fitted_preset
from sweep.spec.settings import TORUS, NotAllowedError, Setting, Value
from sweep.spec.study import Study

PERCENTS = (2, 10)
WAYS = {"up": 1, "down": -1}

Moves = dict[str, Mapping[str, Value]]
"""By spec the new values of settings."""


def details(publication: Publication) -> Makers:
    """The details of a publication: `n-up-2`, `n-down-2`, ... and `drag-of-as_run`.

    A variant whose values are those of one before it is left out.
    """
    studies = needed_studies(publication)
    shifted, seen = _shifted(studies), list[Moves]()
    found: dict[str, Callable[[], Variant]] = {}
    for name, moves in (shifted | _of_other_presets(studies)).items():
        if moves not in seen:
            seen.append(moves)
            found[name] = partial(
                altered,
                publication,
                "details",
                name,
                _about(studies, moves),
                {spec: SpecChange(values) for spec, values in moves.items()},
                share=_share(studies, moves) if name in shifted else None,
            )
    return found


def moved(setting: Setting, value: float, percent: int) -> float:
    """A value moved by so many percent, within the bounds of its setting. A whole
    number is moved by 1 at least, unless it is 0, and by no more than so many percent
    otherwise. It is the same where no other is allowed.
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
    """The numbers that a study does not vary. The size of the world is none of them
    where a map brings it along.
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
    """Each number moved, by the name of the variant. What would not change is left
    out.
    """
    found: dict[str, Moves] = defaultdict(dict)
    for spec, study in studies.items():
        for name, value in _numbers(study).items():
            for percent in PERCENTS:
                for way, sign in WAYS.items():
                    new = moved(study.settings[name], value, sign * percent)
                    if new != value:
                        found[f"{name}-{way}-{percent}"][spec] = {name: new}
    return found


def _of_other_presets(studies: Mapping[str, Study]) -> dict[str, Moves]:
    """Each detail of another preset alone, by the name of the variant. What a spec
    gives itself stays as given.
    """
    found: dict[str, Moves] = defaultdict(dict)
    for spec, study in studies.items():
        given = [name for name in study.settings if study.place_of(name)]
        before = fitted_preset(study.model, study.preset, study.known)
        for preset in study.known.models[study.model].presets:
            after = fitted_preset(study.model, preset, study.known)
            for detail in differing(before, after, given):
                values = {name: after[name] for name in detail}
                if values.get("borders") == TORUS and not after["minimum_image"]:
                    values["minimum_image"] = False
                found[f"{detail[0]}-of-{preset}"][spec] = values
    return found


def _share(studies: Mapping[str, Study], moves: Moves) -> float:
    """By which share of its value a number is moved: the largest of all specs."""
    shares = [
        abs(cast(float, new) / cast(float, value_of(studies[spec], name)) - 1.0)
        for spec, values in moves.items()
        for name, new in values.items()
    ]
    return round(max(shares), 6)


def _about(studies: Mapping[str, Study], moves: Moves) -> str:
    """The values before and after, such as `n 40 to 41`."""
    words = {
        f"{name} {_plain(value_of(studies[spec], name))} to {_plain(new)}": None
        for spec, values in moves.items()
        for name, new in values.items()
    }
    return ", ".join(words)


def _plain(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
