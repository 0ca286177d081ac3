"""The controls of the page.

They are made from the declarations of models, parameters and metrics, so a new model
needs no code here.
"""

import math
from collections.abc import Iterator, Mapping
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
    "as_written": "what the text of the document says",
    "as_run": "what the authors' program does; where there is none, the text",
    "as_reported": "what their program did when the document was written",
    "as_intended": "what they are likely to have meant",
}
"""Meanings of presets that have one of these names."""
Place = tuple[int, int]
"""A trial: the index of its point and the number of its replicate, both from 0."""
MOST = 60
"""The most values of a swept parameter by which a trial is chosen.

Beyond it a trial is chosen by the number of its point.
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
    """Return the controls message of a preset.

    Parameters
    ----------
    model : str
        Model whose parameters are shown.
    preset : str
        Its preset, which gives the default values.
    own : tuple of str, optional
        Names of custom maps of the spec.
    derive : tuple of DerivedMetric, optional
        Metrics that the spec computes from others.
    known : Catalogue, optional
        Models, metrics and maps by name; by default the built-in ones.
    plots : tuple of str, optional
        Metrics that are plotted; they may be metrics of a part of the boids.
    experiments : Path, optional
        Folder with published numbers.

    Returns
    -------
    dict
        ``models``, ``groups`` of parameters, ``maps``, ``metrics`` and ``overlays``;
        ``others`` has the values in which each other preset of the model differs.
        A parameter has ``name``, ``kind``, ``text``, ``unit``, ``allowed``, ``low``,
        ``high``, ``slider``, ``logarithmic``, ``rule``, ``choices`` and ``default``.
    """
    values = preset_settings(model, preset, known)
    chosen = known.models[model]
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
                "source": entry.source,
                "presets": list(entry.presets),
                "texts": _texts(entry),
            }
            for name, entry in known.models.items()
        ],
        "model": model,
        "preset": preset,
        "others": {
            other: _differences(values, preset_settings(model, other, known))
            for other in chosen.presets
            if other != preset
        },
        "groups": [
            {"name": name, "fields": members} for name, members in groups.items()
        ],
        "maps": [
            *_maps(chosen, known),
            *({"name": name, "text": "of the spec", "size": None} for name in own),
        ],
        "metrics": [
            *(
                _metric(
                    name, known.metrics[name], chosen, preset, experiments=experiments
                )
                for name in dict.fromkeys((*known.metrics, *plots))
                if name in known.metrics and not lacks(chosen, known.metrics[name])
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
        texts[name] = "; ".join([*before, f"its torus {WRAPS_ONLY}"])
    return texts


def _differences(
    shown: Mapping[str, Value], other: Mapping[str, Value]
) -> dict[str, Value]:
    """Return the parameters in which another preset differs, with its values."""
    return {name: plain(other[name]) for name in shown if shown[name] != other[name]}


def trials_of(spec: OpenedSpec | None) -> Reply | None:
    """Return the trials of an opened spec, from which a page chooses one."""
    if spec is None:
        return None
    design = spec.design
    return offered(spec.study.name, design.columns, design.n_points, spec.replicates)


def offered(
    study: str, columns: Mapping[str, NDArray[Any]], points: int, replicates: int
) -> Reply:
    """Return the trials of a study, for a page that chooses one.

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
    """
    axes = []
    for name, column in columns.items():
        values = [plain(value) for value in dict.fromkeys(column.tolist())]
        axes.append({"name": name, "values": values if len(values) <= MOST else []})
    return {"study": study, "points": points, "replicates": replicates, "axes": axes}


def trial_of(spec: OpenedSpec | None) -> Reply | None:
    """Return the shown trial of an opened spec, its swept values and its neighbours."""
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
    """Return the shown trial of a study as the state message has it.

    Parameters
    ----------
    here : Place
        The trial.
    values : mapping
        Its values of the parameters that vary.
    before, after : Place or None
        The trials before and after it; None where there is none.
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

    Return None if that value is no number, is infinite, or must be a multiple of the
    time step.
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


def _maps(model: Model, known: Catalogue) -> Iterator[Reply]:
    for name, map_ in known.maps.items():
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
