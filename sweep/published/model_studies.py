"""A study of one's own, begun from what a model says of itself.

Its spec is small enough to be run at once, and above each key stands what it means.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kernels.catalogue import Catalogue
from sweep.campaigns.plan import plan_of
from sweep.design.plan import about
from sweep.errors import SpecError
from sweep.own_code.reading import named_model, study_of
from sweep.published.starting import OWN, Begun, check_new_spec, for_editors
from sweep.spec.keys import keys_of
from sweep.spec.settings import Setting, settings_of, usual_preset
from sweep.spec.strict_yaml import dump
from sweep.spec.study import RecordSpec, Study
from sweep.tables.outputs import unfinished
from sweep.text import unknown

WORKERS = 2
CPU_SECONDS = 12.0
"""Most for all trials. With two workers, and with what Python takes to start, such a
study takes at most about ten seconds.
"""
FEWEST_TRIALS, MOST_TRIALS = 4, 32
"""A point."""
FACTORS = (0.5, 1, 2)
"""Of the usual value of the setting that varies."""
MOST_SERIES, FRAMES = 3, 100
HEAD = """\

# A small study of {model}: {wall} with {workers} workers. The first launch also
# compiles the model, about 15 s of an idle core. Then `sweep table {study}` and
# `sweep plot {study}`. `sweep models {model}` lists all settings, `sweep metrics`
# what can be recorded, and `sweep guide writing` what else a spec can have. Say what
# the study is for in a comment above this one and its empty line: `sweep odd` has it.
"""
"""It begins with an empty line: so it is not the comment that says what a study is for.
"""


@dataclass(frozen=True)
class _Model:
    """A model as a spec names it, by what the catalogue calls it, and the preset."""

    given: str
    name: str
    known: Catalogue
    preset: str

    def usual(self, setting: str) -> Any:
        """The value of a setting in the preset."""
        return self.known.models[self.name].preset_values(self.preset)[setting]

    def settings(self) -> Mapping[str, Setting]:
        return settings_of(self.name, self.known)


def begin_with_model(
    model: str, path: Path | None = None, preset: str = "", *, force: bool = False
) -> Begun:
    """Write the spec of a small study of a model, which varies one of its settings.

        model   a name that `sweep models` lists, or a file, ./NAME.py; its code runs
        path    the file of the new spec; by default that of the model's name
        preset  one of the model's; by default the usual one
        force   whether a file that is there already may be replaced

    Raises SpecError for an unknown model or preset, and where no study of the model can
    be made; OutputError where the file cannot be written. Nothing is written then.
    """
    name, known = named_model(model)
    if name not in known.models:
        raise SpecError(unknown("model", name, known.models))
    target = path or Path(f"{name}.yaml")
    check_new_spec(target, force=force)
    presets = known.models[name].presets
    if preset and preset not in presets:
        raise SpecError(unknown(f"preset of {name}", preset, presets))
    chosen = preset or usual_preset(known.models[name])
    about = _Model(_as_named(model, target.parent), name, known, chosen)
    study = _first_that_can_be(about, target)
    with unfinished(target) as out:
        out.write(study.text.encode())
    return Begun(study, target, (target,))


def _as_named(model: str, folder: Path) -> str:
    """A model as a spec in `folder` names it: its file is named from there."""
    file, colon, name = model.partition(":")
    if not file.startswith("."):
        return model
    there = Path(os.path.relpath(file, folder)).as_posix()
    return f"{there if there.startswith('.') else f'./{there}'}{colon}{name}"


def _first_that_can_be(model: _Model, target: Path) -> Study:
    """The study of the first setting that can be varied as we do."""
    error = SpecError(f"{model.given}: no setting of this model can be varied")
    for setting in _varied(model):
        try:
            return _of_a_size(model, setting, target)
        except SpecError as one:
            error = one
    raise error


def _varied(model: _Model) -> Iterator[Setting]:
    """The numbers that may vary: weights of rules, others of the model, and n."""
    settings = model.settings()
    numbers = [
        one
        for one in settings.values()
        if one.group == "parameters"
        and one.kind == "float"
        and model.usual(one.name) > 0
    ]
    yield from sorted(numbers, key=lambda one: not one.rule)
    yield settings["n"]


def _of_a_size(model: _Model, setting: Setting, target: Path) -> Study:
    """The study of a setting that takes about CPU_SECONDS: with as many trials a point,
    and if these must be few, with fewer steps.
    """

    def study(steps: int, trials: int, wall: float = 0.0) -> Study:
        text = _text(model, setting, f"{OWN}/{target.stem}", steps, trials, wall)
        return study_of(text, target)

    def seconds(steps: int) -> float:
        return plan_of(study(steps, 1), WORKERS).cpu_seconds

    steps = int(model.usual("steps"))
    longest = CPU_SECONDS / FEWEST_TRIALS
    if (needed := seconds(steps)) > longest:
        steps = max(1, int(steps * longest / needed))
        needed = seconds(steps)
    trials = min(max(int(CPU_SECONDS / needed), FEWEST_TRIALS), MOST_TRIALS)
    return study(steps, trials, needed * trials / WORKERS)


def _text(
    model: _Model, setting: Setting, name: str, steps: int, trials: int, wall: float
) -> str:
    usual = model.usual(setting.name)
    fixed = {"n": model.usual("n"), "steps": steps}
    spec = {
        "study": name,
        "model": model.given,
        "preset": model.preset,
        "fixed": {one: value for one, value in fixed.items() if one != setting.name},
        "sweep": {setting.name: [_plain(factor * usual) for factor in FACTORS]},
        "replicates": trials,
        "seed": 1,
        "record": {
            "series": list(model.known.models[model.name].metrics[:MOST_SERIES]),
            "every": max(1, steps // FRAMES),
        },
    }
    head = HEAD.format(model=model.given, study=name, wall=about(wall), workers=WORKERS)
    return for_editors(head + "".join(_lines(spec, _meanings(model))))


def _plain(value: float) -> float:
    return int(value) if value == int(value) else value


def _meanings(model: _Model) -> Callable[[str, str], str]:
    """What a key means, by the key that it stands under and its name."""
    keys = {"": keys_of(Study), "record": keys_of(RecordSpec)}
    texts = {
        under: {key.name: key.text for key in all_} for under, all_ in keys.items()
    }
    settings = model.settings()

    def meaning(under: str, name: str) -> str:
        if under in texts:
            return texts[under][name]
        unit = settings[name].unit
        return settings[name].text + (f", in {unit}" if unit else "")

    return meaning


def _lines(
    section: Mapping[str, Any], meaning: Callable[[str, str], str], under: str = ""
) -> Iterator[str]:
    """The YAML of a mapping, below a comment for each key."""
    indent = "  " if under else ""
    for name, value in section.items():
        yield f"{indent}# {meaning(under, name)}\n"
        if isinstance(value, dict):
            yield f"{name}:\n"
            yield from _lines(value, meaning, name)
        else:
            # A mapping without a list is written in braces.
            line = dump({name: value}).strip().removeprefix("{").removesuffix("}")
            yield f"{indent}{line}\n"
