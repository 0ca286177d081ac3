"""The controls of the page. They are made from what models, settings and metrics say of
themselves, so a new model needs no code here.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.metrics import Metric
from kernels.model import Model
from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.derived_metrics import DerivedMetric
from sweep.spec.recorded import lacks
from sweep.spec.settings import (
    WRAPS_ONLY,
    Setting,
    Value,
    only_wrapping,
    preset_settings,
    settings_of,
    spelled,
)
from sweep.web.claimed import published
from sweep.web.opened import OpenedSpec
from sweep.web.protocol import OVERLAYS, Reply, plain

ROUND = (1.0, 2.0, 5.0)
SLIDER_STEPS = 200
LOGARITHMIC = 1000.0
"""A slider is logarithmic if its ends have at least this ratio."""
PRESETS = {
    "as_written": "what the text of the document says",
    "as_run": "what the authors' program does; where there is none, the text",
    "as_reported": "what their program did when the document was written",
    "as_intended": "what they are likely to have meant",
}
"""What presets stand for that have one of these names."""
Place = tuple[int, int]
"""Of a trial: the number of its point, and of its replicate, both from 0."""
MOST = 60
"""A setting that varies more is not chosen by its values, but by the number of a point.
"""


def controls(
    model: str,
    preset: str,
    own: tuple[str, ...] = (),
    derive: tuple[DerivedMetric, ...] = (),
    known: Catalogue = BUILT_IN,
    plots: tuple[str, ...] = (),
    experiments: Path = EXPERIMENTS,
) -> Reply:
    """The controls message of a preset: models, groups of settings, maps, metrics; and
    `others`, the values in which each other preset of the model differs.

        model        the model whose settings are shown
        preset       its preset, which gives the default values
        own          names of maps that the spec brings
        derive       metrics that it computes from others
        known        what names stand for
        plots        metrics that are plotted, of parts of the boids too
        experiments  the folder with published numbers

    A setting has name, kind, text, unit, allowed, low, high, slider, logarithmic, rule,
    choices and default.
    """
    values, about = preset_settings(model, preset, known), known.models[model]
    groups: dict[str, list[Reply]] = {}
    for setting in settings_of(model, known).values():
        groups.setdefault(setting.group, []).append(
            _control(setting, values[setting.name])
        )
    return {
        "type": "controls",
        "models": [
            {
                "name": name,
                "source": one.source,
                "presets": list(one.presets),
                "texts": _texts(one),
            }
            for name, one in known.models.items()
        ],
        "model": model,
        "preset": preset,
        "others": {
            other: _differences(values, preset_settings(model, other, known))
            for other in about.presets
            if other != preset
        },
        "groups": [
            {"name": name, "fields": members} for name, members in groups.items()
        ],
        "maps": [
            *_maps(about, known),
            *({"name": name, "text": "of the spec", "size": None} for name in own),
        ],
        "metrics": [
            *(
                _metric(name, known.metrics[name], about, preset, experiments)
                for name in dict.fromkeys((*known.metrics, *plots))
                if name in known.metrics and not lacks(about, known.metrics[name])
            ),
            *map(_derived, derive),
        ],
        "overlays": list(OVERLAYS),
    }


def _texts(model: Model) -> dict[str, str]:
    """What presets stand for, of those of which there is something to say."""
    texts = {name: PRESETS[name] for name in model.presets if name in PRESETS}
    for name in only_wrapping(model):
        before = [texts[name]] if name in texts else []
        texts[name] = "; ".join([*before, f"its torus {WRAPS_ONLY}"])
    return texts


def _differences(
    here: Mapping[str, Value], there: Mapping[str, Value]
) -> dict[str, Value]:
    """The settings in which another preset differs, with its values."""
    return {name: plain(there[name]) for name in here if here[name] != there[name]}


def trials_of(spec: OpenedSpec | None) -> Reply | None:
    """The trials of an opened spec, to choose one by its number, or by the values of
    what varies.
    """
    if spec is None:
        return None
    design = spec.design
    return offered(spec.study.name, design.columns, design.n_points, spec.replicates)


def offered(
    study: str, columns: Mapping[str, NDArray[Any]], points: int, replicates: int
) -> Reply:
    """The trials of a study, to choose one; `columns` (P,) are the values of what
    varies at each point.
    """
    axes = []
    for name, column in columns.items():
        values = [plain(value) for value in dict.fromkeys(column.tolist())]
        axes.append({"name": name, "values": values if len(values) <= MOST else []})
    return {"study": study, "points": points, "replicates": replicates, "axes": axes}


def trial_of(spec: OpenedSpec | None) -> Reply | None:
    """Which trial of an opened spec is shown, with the values of what varies, and the
    trials before and after it.
    """
    if spec is None:
        return None
    settings, many = spec.design.settings(spec.point), spec.replicates
    values = {name: settings[name] for name in spec.design.columns}
    here = spec.point * many + spec.replicate
    before, after = (
        divmod(place, many) if 0 <= place < spec.design.n_points * many else None
        for place in (here - 1, here + 1)
    )
    return placed((spec.point, spec.replicate), values, before, after)


def placed(
    here: Place, values: Mapping[str, Value], before: Place | None, after: Place | None
) -> Reply:
    """Which trial of a study is shown, the values of what varies, and its neighbours;
    None where there is none.
    """
    point, replicate = here
    return {
        "point": point,
        "replicate": replicate,
        "values": {name: plain(value) for name, value in values.items()},
        "before": before,
        "after": after,
    }


def _control(setting: Setting, default: Value) -> Reply:
    slider = _slider(setting, default)
    return {
        "name": setting.name,
        "kind": setting.kind,
        "text": setting.text,
        "unit": setting.unit,
        "allowed": setting.allowed(),
        "low": setting.low if math.isfinite(setting.low) else None,
        "high": setting.high if math.isfinite(setting.high) else None,
        "slider": slider,
        "logarithmic": slider is not None
        and slider[0] > 0
        and slider[1] / slider[0] >= LOGARITHMIC,
        "rule": setting.rule,
        "choices": list(setting.choices),
        "default": plain(default),
    }


def _slider(setting: Setting, default: Value) -> list[float] | None:
    """Low, high and step of a slider about the preset value. None if that is no number,
    is infinite, or may only be a whole number of steps.
    """
    if (
        isinstance(default, bool | str)
        or not math.isfinite(default)
        or setting.name == "map"
        or setting.whole_steps
    ):
        return None
    low = setting.low if math.isfinite(setting.low) else min(0.0, 3 * default)
    high = min(setting.high, _round_up(3 * abs(default)) if default else 1.0)
    step = _round_up((high - low) / SLIDER_STEPS)
    if setting.kind == "int":
        low, high, step = float(math.ceil(low)), max(high, low + 1), max(1.0, step)
    elif setting.exclusive:
        low = step
    return [low, high, step]


def _round_up(value: float) -> float:
    """The next number from 1, 2 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(
        (factor * power for factor in ROUND if factor * power >= value), 10 * power
    )


def _maps(model: Model, known: Catalogue) -> Iterator[Reply]:
    for name, about in known.maps.items():
        if about.unit in ("", model.length):
            yield {"name": name, "text": about.text, "size": about.size}


def _metric(
    name: str, about: Metric, model: Model, preset: str, experiments: Path
) -> Reply:
    numbers = [
        number | {"settings": {one: plain(value) for one, value in holds.items()}}
        for own, number in published(model.name, preset, experiments)
        if own == name
        for holds in [number["settings"]]
    ]
    return {
        "name": name,
        "text": about.text,
        "unit": spelled(about.unit, model),
        "source": about.source,
        "published": numbers,
    }


def _derived(one: DerivedMetric) -> Reply:
    about = {"name": one.name, "text": one.expression.text, "unit": one.unit}
    return about | {"source": "computed by the spec", "published": []}
