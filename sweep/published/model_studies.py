"""A custom study, begun from the description of a model.

The spec is small enough to run at once. A comment above each key explains it.
"""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from kernels.catalogue import Catalogue
from sweep.campaigns import plan_of
from sweep.design import about
from sweep.errors import SpecError
from sweep.own_code import named_model, study_of
from sweep.published.starting import OWN, Begun, check_new_spec, for_editors
from sweep.spec import (
    RecordSpec,
    Setting,
    Study,
    dump,
    keys_of,
    settings_of,
    usual_preset,
)
from sweep.tables import unfinished
from sweep.text import unknown

WORKERS = 2
CPU_SECONDS = 12.0
"""Largest CPU time in seconds of all trials.

With two workers, a study takes at most about ten seconds, including the start of
Python.
"""
FEWEST_TRIALS = 4
"""Fewest trials per point."""
MOST_TRIALS = 32
"""Most trials per point."""
FACTORS = (0.5, 1, 2)
"""Factors of the usual value of the parameter that varies."""
MOST_SERIES = 3
FRAMES = 100
HEAD = """\

# A small study of {model}: {wall} with {workers} workers. The first launch also
# compiles the model, about 15 s on an idle core. Then run `sweep table {study}` and
# `sweep plot {study}`. `sweep models {model}` lists all parameters, `sweep metrics`
# all metrics, and `sweep guide writing` the keys of a spec. Describe the purpose of
# the study in a comment above this comment and the empty line, for `sweep odd`.
"""
"""First comment of a spec.

The first line is empty, so that the comment does not count as the purpose of a study.
"""


@dataclass(frozen=True)
class _Model:
    """A model, with the name in a spec, the name in the catalogue, and a preset."""

    reference: str
    name: str
    catalogue: Catalogue
    preset: str

    def usual(self, setting: str) -> Any:
        """Return the value of a parameter in the preset."""
        return self.catalogue.models[self.name].preset_values(self.preset)[setting]

    def settings(self) -> Mapping[str, Setting]:
        return settings_of(self.name, self.catalogue)


def begin_with_model(
    model: str, path: Path | None = None, preset: str = "", *, force: bool = False
) -> Begun:
    """Write the spec of a small study that varies one parameter of a model.

    After an error, no file is written.

    Parameters
    ----------
    model : str
        A name that `sweep models` lists, or a file such as ./NAME.py, which runs.
    path : Path, optional
        File of the new spec; by default the name of the model.
    preset : str, default ""
        Preset of the model; "" for the usual preset.
    force : bool, default False
        Allow to replace an existing file.

    Returns
    -------
    Begun

    Raises
    ------
    SpecError
        If the model or the preset is unknown, or no study of the model can be made.
    OutputError
        If the file cannot be written.
    """
    name, catalogue = named_model(model)
    if name not in catalogue.models:
        raise SpecError(unknown("model", name, catalogue.models))
    target = path or Path(f"{name}.yaml")
    check_new_spec(target, force=force)
    presets = catalogue.models[name].presets
    if preset and preset not in presets:
        raise SpecError(unknown(f"preset of {name}", preset, presets))
    chosen = preset or usual_preset(catalogue.models[name])
    chosen_model = _Model(_as_named(model, target.parent), name, catalogue, chosen)
    study = _first_that_can_be(chosen_model, target)
    with unfinished(target) as out:
        out.write(study.text.encode())
    return Begun(study.name, study.command, target, (target,))


def _as_named(model: str, folder: Path) -> str:
    """Return the name of a model, with the file relative to `folder`."""
    file, colon, name = model.partition(":")
    if not file.startswith("."):
        return model
    relative = Path(os.path.relpath(file, folder)).as_posix()
    return f"{relative if relative.startswith('.') else f'./{relative}'}{colon}{name}"


def _first_that_can_be(model: _Model, target: Path) -> Study:
    """Return the study of the first parameter that can be varied by FACTORS."""
    error = SpecError(f"{model.reference}: no parameter of this model can be varied")
    for setting in _varied(model):
        try:
            return _of_a_size(model, setting, target)
        except SpecError as mistake:
            error = mistake
    raise error


def _varied(model: _Model) -> Iterator[Setting]:
    """Yield the numbers that may vary: weights of rules, further numbers, and n."""
    settings = model.settings()
    numbers = [
        setting
        for setting in settings.values()
        if setting.group == "parameters"
        and setting.kind == "float"
        and model.usual(setting.name) > 0
    ]
    yield from sorted(numbers, key=lambda setting: not setting.rule)
    yield settings["n"]


def _of_a_size(model: _Model, setting: Setting, target: Path) -> Study:
    """Return the study of a parameter that takes about CPU_SECONDS.

    The number of trials per point follows from the time of one trial. The number of
    steps is reduced if FEWEST_TRIALS take too long.
    """

    def study(steps: int, trials: int, wall: float = 0.0) -> Study:
        name = f"{OWN}/{target.stem}"
        text = _text(model, setting, name, steps, trials=trials, wall=wall)
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
        "model": model.reference,
        "preset": model.preset,
        "fixed": {key: value for key, value in fixed.items() if key != setting.name},
        "sweep": {setting.name: [_plain(factor * usual) for factor in FACTORS]},
        "replicates": trials,
        "seed": 1,
        "record": {
            "series": list(model.catalogue.models[model.name].metrics[:MOST_SERIES]),
            "every": max(1, steps // FRAMES),
        },
    }
    head = HEAD.format(
        model=model.reference, study=name, wall=about(wall), workers=WORKERS
    )
    return for_editors(head + "".join(_lines(spec, _meanings(model))))


def _plain(value: float) -> float:
    return int(value) if value == int(value) else value


def _meanings(model: _Model) -> Callable[[str, str], str]:
    """Return a function that explains a key, by parent key and name."""
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
    """Yield the YAML of a mapping, with a comment above each key."""
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
