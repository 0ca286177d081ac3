"""The controls of the page. They are made from what models, settings and metrics say of
themselves, so a new model needs no code here.
"""

import math
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.metrics import Metric
from kernels.model import Model
from sweep.errors import SpecError
from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.derived_metrics import DerivedMetric
from sweep.spec.recorded import Column, lacks
from sweep.spec.settings import Setting, Value, preset_settings, settings_of, spelled
from sweep.spec.strict_yaml import read_document
from sweep.web.protocol import OVERLAYS, Reply, plain

ROUND = (1.0, 2.0, 5.0)
SLIDER_STEPS = 200
LOGARITHMIC = 1000.0
"""A slider is logarithmic if its ends have at least this ratio."""


def controls(
    model: str,
    preset: str,
    own: tuple[str, ...] = (),
    derive: tuple[DerivedMetric, ...] = (),
    known: Catalogue = BUILT_IN,
    experiments: Path = EXPERIMENTS,
) -> Reply:
    """The controls message of a preset: models, groups of settings, maps, metrics.

        model        the model whose settings are shown
        preset       its preset, which gives the default values
        own          names of maps that the spec brings
        derive       metrics that it computes from others
        known        what names stand for
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
            {"name": name, "source": one.source, "presets": list(one.presets)}
            for name, one in known.models.items()
        ],
        "model": model,
        "preset": preset,
        "groups": [
            {"name": name, "fields": members} for name, members in groups.items()
        ],
        "maps": [
            *_maps(about, known),
            *({"name": name, "text": "of the spec", "size": None} for name in own),
        ],
        "metrics": [
            *(
                _metric(name, metric, about, preset, experiments)
                for name, metric in known.metrics.items()
                if not lacks(about, metric)
            ),
            *map(_derived, derive),
        ],
        "overlays": list(OVERLAYS),
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
    or is infinite.
    """
    if (
        isinstance(default, bool | str)
        or not math.isfinite(default)
        or setting.name == "map"
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
        number
        for own, number in published(model.name, preset, experiments)
        if own == name
    ]
    return {
        "name": name,
        "text": about.text,
        "unit": spelled(about.unit, model),
        "published": numbers,
    }


def _derived(one: DerivedMetric) -> Reply:
    text = one.expression.text
    return {"name": one.name, "text": text, "unit": one.unit, "published": []}


@cache
def published(
    model: str, preset: str, experiments: Path
) -> tuple[tuple[str, Reply], ...]:
    """Published means of this model and preset, each with its metric: value, where,
    says, frame and settings.

    They come from each published.yaml in `experiments`. A file that is missing or
    cannot be read gives none. `settings` are those that the spec or the claim fixes:
    the number holds for these values only.
    """
    found = []
    for file in sorted(experiments.glob("*/published.yaml")):
        try:
            found += list(_numbers(file, model, preset))
        except SpecError:
            continue
    return tuple(found)


def _numbers(file: Path, model: str, preset: str) -> Iterator[tuple[str, Reply]]:
    claims = _content(file).get("claims", [])
    specs = {
        spec: _fixed(file.parent / f"{spec}.yaml", model, preset)
        for spec in {c.get("spec") for c in claims}
    }
    for claim in claims:
        measure, expected = claim.get("measure", {}), claim.get("expect", {})
        fixed = specs[claim.get("spec")]
        if fixed is None or "mean" not in measure or "value" not in expected:
            continue
        settings = {
            name: plain(value)
            for name, value in (fixed | measure.get("for", {})).items()
        }
        about = {
            "where": str(claim["where"]),
            "says": str(claim["says"]),
            "frame": measure.get("frame"),
        }
        yield (
            Column.read(measure["mean"]).metric,
            {"value": expected["value"], **about, "settings": settings},
        )


def _fixed(file: Path, model: str, preset: str) -> dict[str, Any] | None:
    """What a spec fixes; None without a spec, or if it is of another model or
    preset.
    """
    if not file.exists():
        return None
    spec = _content(file)
    return (
        dict(spec.get("fixed", {}))
        if (spec.get("model"), spec.get("preset")) == (model, preset)
        else None
    )


@cache
def _content(file: Path) -> Mapping[str, Any]:
    content: Mapping[str, Any] = read_document(file).value
    return content
