"""Pages of the models: equations, a picture, trials that run in the page, differences
from the publication, and all parameters with the values of each preset.
"""

import inspect
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from docs.building.documents import ROOT
from docs.building.reference import cell, code, table
from kernels.catalogue import Catalogue
from kernels.model import Model
from kernels.models import MODELS
from sweep.cli.listing import spreads_text, torus_text
from sweep.cli.supplementing import computed_page
from sweep.design import Jobs, expand
from sweep.own_code.reading import named_model, study_of
from sweep.published.publications import Publication, read_all
from sweep.replays import write_picture
from sweep.spec import Study
from sweep.spec.settings import GROUPS, Setting, settings_of, usual_preset
from sweep.workers import Loky, core_count

PICTURES = "_models"
MOST_STEPS = 150
"""Of the trial that a picture shows: most boids of unbounded models are still in it."""
MOST_COMPUTED = 600
"""Steps of a trial that a page computes."""
REPLICATES = 3
DIFFERENCES = "Differences from the publication"
"""Chapter of a study page that the page of its model takes in."""
GROUP_NAMES = {"parameters": "Parameters of the model"} | {
    name: f"Parameters of all models: {name}" for name, _ in GROUPS
}


def model_pages() -> Iterator[tuple[str, str]]:
    """The name and the text of each page."""
    studies = {one.name: one for one in read_all(ROOT / "experiments", quick=True)}
    yield "reference/models/index", _list_of_models()
    for name, model in MODELS.items():
        yield f"reference/models/{name}", _page(name, model, studies)


def draw_models(sources: Path) -> None:
    """Write the picture of each model below the sources of the site."""
    folder = sources / PICTURES
    folder.mkdir(parents=True)
    for name, model in MODELS.items():
        study = _shown(name, model)
        job = Jobs(study, expand(study))[0]
        steps = int(job.settings["steps"])
        write_picture(study.name, job, steps, folder / f"{name}.png", _unreported)


def write_computed(sources: Path) -> None:
    """Write the page of each model that computes trials, below the sources."""
    engine = Loky(core_count())
    try:
        for name, model in MODELS.items():
            title = f"The model {name}"
            page = computed_page(_computed(name, model), title, engine, _unreported)
            (sources / PICTURES / f"{name}.html").write_bytes(page)
    finally:
        engine.stop()


def _computed(name: str, model: Model) -> Study:
    """The study whose trials a page computes: the default preset, with fewer and with
    more boids.
    """
    preset = usual_preset(model)
    values = model.preset_values(preset)
    steps = min(MOST_COMPUTED, values["steps"])
    sizes = [max(2, values["n"] // 2), values["n"], 2 * values["n"]]
    return study_of(
        f"study: {name}\nmodel: {name}\npreset: {preset}\nfixed: {{steps: {steps}}}\n"
        f"sweep: {{n: {sizes}}}\nreplicates: {REPLICATES}\n"
    )


def _unreported(_done: int, _steps: int) -> None:
    """Report no progress."""


def _shown(name: str, model: Model) -> Study:
    """The study whose only trial a picture shows, with the default preset."""
    preset = usual_preset(model)
    steps = min(MOST_STEPS, model.preset_values(preset)["steps"])
    return study_of(
        f"study: {name}\nmodel: {name}\npreset: {preset}\nfixed: {{steps: {steps}}}\n"
        "replicates: 1\n"
    )


def _list_of_models() -> str:
    rows = "".join(
        f"| [{name}]({name}.md) | {', '.join(map(code, one.presets))}"
        f" | {cell(one.source)} |\n"
        for name, one in MODELS.items()
    )
    names = "\n".join(MODELS)
    return (
        "# Models\n\nA model is the physics of one published work. A preset is one"
        " complete set of values for all parameters: see [the names of presets]"
        "(../../explanations/presets.md). A study may also use [a custom model]"
        "(../../guide/custom-models.md).\n\n"
        "| model | presets | source |\n| --- | --- | --- |\n"
        f"{rows}\n```{{toctree}}\n:hidden:\n{names}\n```\n"
    )


def _page(name: str, model: Model, studies: Mapping[str, Publication]) -> str:
    module = sys.modules[model.params.__module__]
    known = named_model(name, code=False)[1]
    about = inspect.cleandoc(module.__doc__ or "")
    recorded = ", ".join(map(code, model.metrics))
    shown = _shown(name, model)
    return (
        f"# {name}\n\n{about}\n\n*Source:* {model.source}. Lengths are in"
        f" {model.length}, and times in {model.time}. By default a study records"
        f" {recorded}.\n\n"
        f"![boids of {name}](/{PICTURES}/{name}.png)\n\n"
        f"*The last of {shown.fixed['steps']} steps of one trial, with the preset"
        f" {code(shown.preset)}.*\n\n"
        "## Run the model here\n\nYour browser runs these trials, and compares them"
        " with stored results, bit for bit: see [interactive figures]"
        "(../../guide/interactive-figures.md#trials-that-the-browser-computes).\n\n"
        f'<iframe class="computed" loading="lazy" title="trials of {name}"'
        f' src="../../{PICTURES}/{name}.html?embed"></iframe>\n\n'
        f"## Equations\n\n{model.equations.strip()}\n"
        + _judged(studies[name])
        + _settings(name, model, known)
    )


def _judged(publication: Publication) -> str:
    """What the study page reports of the model, and how many claims are tested."""
    document = f"experiments/{publication.name}/README.md"
    page = f"../../studies/{publication.name}.md"
    return (
        f"\n## {DIFFERENCES}\n\n<!-- from: {document}, {DIFFERENCES} -->\n\n"
        f"## Tests against the publication\n\n`sweep reproduce --only"
        f" {publication.name}` tests {len(publication.claims)} statements about this"
        f" model. [The study page]({page}) lists the studies, the figures and what was"
        " not reproduced.\n"
    )


def _settings(name: str, model: Model, known: Catalogue) -> str:
    every = settings_of(name, known)
    settings = every.values()
    groups = list(dict.fromkeys(setting.group for setting in settings))
    told = [*torus_text(model), spreads_text(every)]
    presets = [model.preset_values(preset) for preset in model.presets]
    return (
        "\n"
        + "".join(f"{line}.\n\n" for line in told)
        + "\n".join(
            f"## {GROUP_NAMES[group]}\n\n"
            + table(
                [
                    "parameter",
                    "symbol",
                    "meaning",
                    "allowed",
                    *map(code, model.presets),
                ],
                [_setting(one, presets) for one in settings if one.group == group],
            )
            for group in groups
        )
    )


def _setting(setting: Setting, presets: list[dict[str, Any]]) -> list[object]:
    values = [preset[setting.name] for preset in presets]
    symbol = f"${setting.symbol}$" if setting.symbol else ""
    described = [setting.text, setting.allowed(), *map(_value, values)]
    return [code(setting.name), symbol, *described]


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)
