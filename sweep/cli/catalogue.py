"""Commands that list models, maps and metrics, and the schema of a spec."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sweep.cli.app import CodeFrom, Group, Json, NoCode, app, stop
from sweep.cli.completing import model_names
from sweep.text import unknown

if TYPE_CHECKING:
    from kernels.registry import Registry


@app.command(rich_help_panel=Group.start)
def models(
    name: Annotated[
        str | None,
        typer.Argument(
            autocompletion=model_names,
            help="Model, or file with a model such as ./NAME.py; by default a list of"
            " all models.",
        ),
    ] = None,
    no_code: NoCode = False,
    as_json: Json = False,
) -> None:
    """List all models, or the parameters of one model.

    For one model, prints units, ranges and preset values, and the parameters that may
    differ from robot to robot.

    Examples
    --------
    sweep models
    sweep models nguyen2024
    """
    import json

    from kernels.catalogue import BUILT_IN
    from kernels.models import MODELS
    from sweep.cli.listing import model_json, model_settings, model_table
    from sweep.own_code import named_model

    if name is None:
        if as_json:
            described = [model_json(model, BUILT_IN) for model in MODELS]
            print(json.dumps(described, indent=1))
        else:
            _print(model_table(), MODELS)
        return
    model, catalogue = named_model(name, code=not no_code)
    if model not in catalogue.models:
        stop(unknown("model", model, catalogue.models), 2)
    if as_json:
        print(json.dumps(model_json(model, catalogue), indent=1))
    else:
        _print(model_settings(model, catalogue))


@app.command(rich_help_panel=Group.start)
def maps() -> None:
    """List the maps of obstacles.

    Examples
    --------
    sweep maps
    sweep view --model patel2023 --preset as_intended --map random_obstacles
    """
    from kernels.worlds import MAPS
    from sweep.cli.listing import map_table

    _print(map_table(), MAPS)


@app.command(rich_help_panel=Group.start)
def metrics() -> None:
    """List the metrics and profiles with units and sources.

    A profile is a metric with values along an axis.

    Examples
    --------
    sweep metrics
    sweep table my/first --metric speed
    """
    from kernels.metrics import METRICS
    from kernels.profiles import PROFILES
    from sweep.cli.listing import metric_table, profile_table

    _print(metric_table(), METRICS)
    _print(profile_table(), PROFILES)


@app.command(rich_help_panel=Group.start)
def schema(
    spec: Annotated[
        Path | None,
        typer.Option(
            help="Spec whose custom models, metrics, maps and initial conditions the"
            " schema includes. The files of this code run."
        ),
    ] = None,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Print the JSON Schema of specs, for editors.

    Editors use the schema to check and complete a spec.

    Examples
    --------
    sweep schema
    sweep schema --spec spec.yaml
    """
    import json

    from sweep.own_code import schema_for
    from sweep.spec import json_schema

    if spec:
        form = schema_for(spec, code=not no_code, code_from=code_from)
    else:
        form = json_schema()
    print(json.dumps(form, indent=1))


def _print(renderable: Any, registry: "Registry[Any] | None" = None) -> None:
    """Print a table, and on stderr the entries of `registry` that cannot be used."""
    from sweep.cli.listing import refusals
    from sweep.cli.terminal import console

    console().print(renderable)
    for line in refusals(registry) if registry is not None else ():
        print(line, file=sys.stderr)
