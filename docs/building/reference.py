"""Pages of the reference that follow from the program: commands, metrics, maps and
starts, and the columns of tables.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from enum import Enum
from typing import Any

import pyarrow as pa
import typer.main

from kernels.metrics import METRICS, Metric
from kernels.profiles import PROFILES
from kernels.starts import STARTS
from kernels.worlds import MAPS
from sweep import cli
from sweep.cli.app import Group
from sweep.own_code.reading import study_of
from sweep.spec.recorded import declaration_of
from sweep.store.rows import (
    heatmaps_schema,
    series_schema,
    trajectories_schema,
    trials_schema,
)

SHOWN = """
study: shown
model: aziel_chen2025
preset: as_run
sweep: {n: [50, 100]}
replicates: 10
record: {metrics: [speed, coverage], series: [coverage], heatmaps: true}
"""
"""The study whose columns are shown."""


def reference_pages() -> Iterator[tuple[str, str]]:
    """The name and the text of each page."""
    yield "reference/commands", commands_page()
    yield "reference/metrics", metrics_page()
    yield "reference/maps-and-starts", maps_page()
    yield "reference/columns", columns_page()


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *([cell(one) for one in row] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def cell(value: object) -> str:
    """A text as it stands, within a table in Markdown. Code in backticks stays code,
    and a symbol between dollar signs stays one.
    """
    parts = re.split(r"(`[^`]*`|^\$[^$]*\$$)", " ".join(str(value).split()))
    parts[::2] = [re.sub(r"([*_<\[\\])", r"\\\1", part) for part in parts[::2]]
    return "".join(parts).replace("|", "\\|")


def code(value: object) -> str:
    """A text in backticks; nothing for an empty one."""
    return f"`{value}`" if str(value) else ""


def commands_page() -> str:
    """Every command with its arguments, options and examples, by groups."""
    commands = typer.main.get_command(cli.app).commands  # type: ignore[attr-defined]
    grouped = {
        group: {
            name: command
            for name, command in commands.items()
            if command.rich_help_panel == group
        }
        for group in Group
    }
    first = (
        "# Commands\n\nThis page is made from the program, as `sweep COMMAND --help`"
        " is. Data goes to stdout, and messages go to stderr.\n\n"
    )
    ends = table(
        ["exit code", "meaning"],
        [
            (code(0), "fine"),
            (code(1), "some trials diverged, failed or timed out, or differ"),
            (code(2), "wrong usage, or a mistake in a spec"),
            (code(130), "ended by Ctrl-C; the same command resumes the run"),
        ],
    )
    groups = table(
        ["group", "commands"],
        [(group, ", ".join(map(code, members))) for group, members in grouped.items()],
    )
    parts = [
        _command(name, command)
        for members in grouped.values()
        for name, command in members.items()
    ]
    return f"{first}{ends}\n{groups}" + "".join(parts)


def _command(name: str, command: Any) -> str:
    arguments = [one for one in command.params if one.param_type_name == "argument"]
    options = [one for one in command.params if one.param_type_name == "option"]
    shown = " ".join([name, *map(_argument, arguments), *["[OPTIONS]"][: len(options)]])
    parts = [f"\n## {name}\n\n```text\nsweep {shown}\n```\n\n{command.help}\n\n"]
    rows = [(code(_argument(one)), one.help or "", "") for one in arguments]
    rows += [(code(_option(one)), one.help or "", _default(one)) for one in options]
    if rows:
        parts.append(table(["argument or option", "meaning", "default"], rows))
    if command.examples:
        examples = "\n".join(command.examples)
        parts.append(f"\nExamples:\n\n```sh\n{examples}\n```\n")
    return "".join(parts)


def _argument(argument: Any) -> str:
    name = (argument.metavar or argument.name.upper()).strip("[]")
    many = " ..." if argument.nargs == -1 else ""
    return name + many if argument.required else f"[{name}]{many}"


def _option(option: Any) -> str:
    names = ", ".join(option.opts)
    if option.is_flag:
        return names
    named = option.metavar or option.name.upper()
    if isinstance(option.default, Enum):
        named = "|".join(option.default.__class__)
    return f"{names} {named}"


def _default(option: Any) -> str:
    default = getattr(option.default, "value", option.default)
    if option.required:
        return "required"
    return "" if default is None or default is False else code(default)


def metrics_page() -> str:
    """Every metric: unit, distribution, direction, need and source."""
    head = [
        *("metric", "what it is", "unit", "its values are", "range", "better"),
        *("it needs", "source"),
    ]
    rows = [
        (
            *(code(name), one.text, one.unit, one.distribution),
            *(declaration_of(one).support.words, one.better, needs(one), one.source),
        )
        for name, one in METRICS.items()
    ]
    profiles = [
        (code(name), one.text, one.axis, one.unit, one.source)
        for name, one in PROFILES.items()
    ]
    defined = {name: one.formula for name, one in METRICS.items()}
    defined |= {name: one.formula for name, one in PROFILES.items()}
    formulas = "".join(
        f"\n### {code(name)}\n\n{formula}\n"
        for name, formula in defined.items()
        if formula
    )
    return (
        "# Metrics\n\nA metric is one number for each recorded frame of a trial. Tables"
        " have the value at the last frame, in the column of the metric's name, and"
        " the mean over the second half of the trial, or over an event of a recording,"
        " in `<name>_mean`. `length` and"
        " `time` are the units of the model: px and step, or m and s. The distribution"
        " of the values from trial to trial selects [the confidence interval of the"
        " mean](../explanations/intervals.md). `sweep metrics` prints this list.\n\n"
        + table(head, rows)
        + "\n## Profiles\n\nA [profile](../guide/profiles.md) is a metric with a value"
        " at each position along an axis.\n\n"
        + table(["profile", "what it is", "axis", "unit", "source"], profiles)
        + "\n## Definitions\n\nBoid $i$ of $N$ has the position $p_i$ and the velocity"
        " $v_i$. $\\bar p$ is the mean position.\n" + formulas
    )


def needs(metric: Metric) -> str:
    """What a model or a spec must have for a metric, in words."""
    found = {
        "a pair potential": metric.potential,
        "kinds of boids": metric.kinds,
        "states of boids": metric.state,
    }
    words = [name for name, needed in found.items() if needed]
    return "; ".join([*words, *(f"`{one.condition}`" for one in metric.demands)])


def maps_page() -> str:
    """Maps and starts."""
    maps = [
        (code(name), one.text, _map_size(one.size, one.unit), one.source)
        for name, one in MAPS.items()
    ]
    starts = [(code(name), one.text, one.source) for name, one in STARTS.items()]
    return (
        "# Maps and starts\n\n## Maps\n\nA map is the obstacles of a world: the setting"
        " `map`. A spec can bring [custom maps](../guide/custom-maps.md).\n\n"
        + table(["map", "what it is", "size", "source"], maps)
        + "\n## Starts\n\nA start is how the first positions and velocities are drawn:"
        " the setting `start_draws`.\n\n"
        + table(["start", "what it is", "source"], starts)
    )


def _map_size(size: tuple[float, float] | None, unit: str) -> str:
    return f"{size[0]:g} x {size[1]:g} {unit}" if size else "any"


def columns_page() -> str:
    """The columns of each table, of a study that records everything."""
    study = study_of(SHOWN)
    model = study.catalogue.models[study.model]
    tables = {
        "trials": ("one row a trial", trials_schema(study, {})),
        "series": ("one row a recorded frame", series_schema(study, {})),
        "heatmaps": ("one row a trial", heatmaps_schema({})),
        "trajectories": ("one row a recorded frame", trajectories_schema(model, {})),
    }
    first = (
        "# Columns of the tables\n\nThe tables of a study are parquet files, and each"
        " column says in its metadata its unit and what it is. `sweep columns STUDY`"
        " prints the same for a study of yours. Shown here are the columns of this"
        f" study, with trajectories:\n\n```text{SHOWN}```\n"
    )
    parts = [
        f"\n## {name}\n\n`study.{name}`: {rows}.\n\n"
        + table(["column", "type", "unit", "what it is"], map(_column, schema))
        for name, (rows, schema) in tables.items()
    ]
    return first + "".join(parts)


def _column(field: pa.Field) -> tuple[str, ...]:
    about = field.metadata or {}
    unit, text = (about.get(key, b"").decode() for key in (b"unit", b"text"))
    return code(field.name), str(field.type), unit, text
