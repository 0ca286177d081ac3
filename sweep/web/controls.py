"""The controls of the page.

The declarations of models, parameters and metrics give the controls, so a new model
needs no code here.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.metrics import Metric
from kernels.model import Model
from sweep.spec import (
    EXPERIMENTS,
    WRAPS_ONLY,
    DerivedMetric,
    Setting,
    Value,
    lacks,
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
    "as_written": "as the text of the publication states",
    "as_run": "as the authors' program does, or the text if no program exists",
    "as_reported": "as the authors' program did at the time of the publication",
    "as_intended": "as the authors probably intended",
}
"""Meanings of presets by name."""
Place = tuple[int, int]
"""A trial: the index of its point and the number of its replicate, both from 0."""
MOST = 60
"""Largest number of values of a swept parameter by which a trial is chosen.

For more values a trial is chosen by the number of its point.
"""


def controls(
    model: str,
    preset: str,
    own: tuple[str, ...] = (),
    derive: tuple[DerivedMetric, ...] = (),
    catalogue: Catalogue = BUILT_IN,
    plots: tuple[str, ...] = (),
    experiments: Path = EXPERIMENTS,
) -> Reply:
    """Return the controls message of a preset.

    Parameters
    ----------
    model : str
        Model whose parameters are shown.
    preset : str
        Preset of the model, which gives the default values.
    own : tuple of str, optional
        Names of custom maps of the spec.
    derive : tuple of DerivedMetric, optional
        Metrics that the spec computes from other metrics.
    catalogue : Catalogue, optional
        Models, metrics and maps by name; by default the built-in ones.
    plots : tuple of str, optional
        Metrics that are plotted, also metrics of a part of the boids.
    experiments : Path, optional
        Folder with published numbers.

    Returns
    -------
    dict
        ``models``, ``groups`` of parameters, ``maps``, ``metrics`` and ``overlays``;
        ``others`` has, per further preset of the model, the values that differ.
        A parameter has ``name``, ``kind``, ``text``, ``unit``, ``allowed``, ``low``,
        ``high``, ``slider``, ``logarithmic``, ``rule``, ``choices`` and ``default``.
    """
    values = preset_settings(model, preset, catalogue)
    chosen = catalogue.models[model]
    groups: dict[str, list[Reply]] = {}
    for setting in settings_of(model, catalogue).values():
        groups.setdefault(setting.group, []).append(
            _control(setting, values[setting.name])
        )
    return {
        "type": "controls",
        "models": [
            {
                "name": name,
                "source": entry.source,
                "presets": list(entry.presets),
                "texts": _texts(entry),
            }
            for name, entry in catalogue.models.items()
        ],
        "model": model,
        "preset": preset,
        "others": {
            other: _differences(values, preset_settings(model, other, catalogue))
            for other in chosen.presets
            if other != preset
        },
        "groups": [
            {"name": name, "fields": members} for name, members in groups.items()
        ],
        "maps": [
            *_maps(chosen, catalogue),
            *({"name": name, "text": "of the spec", "size": None} for name in own),
        ],
        "metrics": [
            *(
                _metric(
                    name,
                    catalogue.metrics[name],
                    chosen,
                    preset,
                    experiments=experiments,
                )
                for name in dict.fromkeys((*catalogue.metrics, *plots))
                if name in catalogue.metrics
                and not lacks(chosen, catalogue.metrics[name])
            ),
            *map(_derived, derive),
        ],
        "overlays": list(OVERLAYS),
    }


def _texts(model: Model) -> dict[str, str]:
    """Return the meanings of presets, for those presets that have a text."""
    texts = {name: PRESETS[name] for name in model.presets if name in PRESETS}
    for name in only_wrapping(model):
        before = [texts[name]] if name in texts else []
        texts[name] = "; ".join([*before, f"the torus {WRAPS_ONLY}"])
    return texts


def _differences(
    shown: Mapping[str, Value], other: Mapping[str, Value]
) -> dict[str, Value]:
    """Return the parameters in which another preset differs, with the other values."""
    return {name: plain(other[name]) for name in shown if shown[name] != other[name]}


def trials_of(spec: OpenedSpec | None) -> Reply | None:
    """Return the trials of an opened spec, from which a page chooses."""
    if spec is None:
        return None
    design = spec.design
    return offered(
        spec.study.name,
        design.columns,
        design.n_points,
        spec.replicates,
        drawn=[
            name for axis in spec.study.axes if axis.sampler for name in axis.columns
        ],
    )


def offered(
    study: str,
    columns: Mapping[str, NDArray[Any]],
    points: int,
    replicates: int,
    *,
    drawn: Collection[str] = (),
) -> Reply:
    """Return the trials of a study, for a page that chooses a trial.

    Parameters
    ----------
    study : str
        Name of the study.
    columns : mapping of str to array
        Values (P,) of each parameter that varies, one per point.
    points : int
        Number of points.
    replicates : int
        Trials per point.
    drawn : collection of str, optional
        Parameters that a sampler draws: each is free, although points of a small sample
        differ in all of them.
    """
    axes = []
    values = {name: column.tolist() for name, column in columns.items()}
    for name in values:
        distinct = [plain(value) for value in dict.fromkeys(values[name])]
        few = len(distinct) <= MOST
        source = _source(values, name) if few and name not in drawn else ""
        axes.append(
            {"name": name, "values": distinct if few else [], "follows": source}
        )
    return {"study": study, "points": points, "replicates": replicates, "axes": axes}


def _source(values: Mapping[str, list[Any]], name: str) -> str:
    """Return the first of the earlier parameters from which a parameter follows.

    Each value of that parameter has a single value of `name`. The text is "" if no
    parameter has this property.
    """
    for other in values:
        if other == name:
            break
        pairs = {*zip(values[other], values[name], strict=True)}
        if len(pairs) == len({*values[other]}):
            return other
    return ""


def trial_of(spec: OpenedSpec | None) -> Reply | None:
    """Return the shown trial of an opened spec, swept values and adjacent trials."""
    if spec is None:
        return None
    settings = spec.design.settings(spec.point)
    replicates = spec.replicates
    values = {name: settings[name] for name in spec.design.columns}
    here = spec.point * replicates + spec.replicate
    count = spec.design.n_points * replicates
    before, after = (
        divmod(index, replicates) if 0 <= index < count else None
        for index in (here - 1, here + 1)
    )
    return placed((spec.point, spec.replicate), values, before, after)


def placed(
    here: Place, values: Mapping[str, Value], before: Place | None, after: Place | None
) -> Reply:
    """Return the shown trial of a study in the form of the state message.

    Parameters
    ----------
    here : Place
        The trial.
    values : mapping
        Values of the parameters that vary.
    before, after : Place or None
        The previous and the next trial; None at an end of the study.
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
    """Return low, high and step of a slider around the preset value.

    Return None if the preset value is not a number, is infinite, or must be a multiple
    of the time step.
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
        high = max(high, low + 1)
        low = float(math.ceil(low))
        step = max(1.0, step)
    elif setting.exclusive:
        low = step
    return [low, high, step]


def _round_up(value: float) -> float:
    """Return the next number from 1, 2 and 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(
        (factor * power for factor in ROUND if factor * power >= value), 10 * power
    )


def _maps(model: Model, catalogue: Catalogue) -> Iterator[Reply]:
    for name, map_ in catalogue.maps.items():
        if map_.unit in ("", model.length):
            yield {"name": name, "text": map_.text, "size": map_.size}


def _metric(
    name: str, metric: Metric, model: Model, preset: str, experiments: Path
) -> Reply:
    numbers = [
        number | {"settings": {name: plain(value) for name, value in holds.items()}}
        for measured, number in published(model.name, preset, experiments)
        if measured == name
        for holds in [number["settings"]]
    ]
    return {
        "name": name,
        "text": metric.text,
        "unit": spelled(metric.unit, model),
        "source": metric.source,
        "published": numbers,
    }


def _derived(metric: DerivedMetric) -> Reply:
    return {
        "name": metric.name,
        "text": metric.expression.text,
        "unit": metric.unit,
        "source": "computed by the spec",
        "published": [],
    }
