"""Commands that list models, maps and metrics, and the schema of a spec."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sweep.cli.app import CodeFrom, Json, NoCode, app, stop
from sweep.cli.completing import model_names
from sweep.text import unknown

if TYPE_CHECKING:
    from kernels.registry import Registry


@app.command()
def models(
    name: Annotated[
        str | None,
        typer.Argument(
            autocompletion=model_names,
            help="A model, or a file that has one: ./NAME.py, for all its settings.",
        ),
    ] = None,
    no_code: NoCode = False,
    as_json: Json = False,
) -> None:
    """List the models, or the settings of one with units, ranges and preset values.

    Of one model it also shows which parameters may differ from robot to robot.
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
    model, known = named_model(name, code=not no_code)
    if model not in known.models:
        stop(unknown("model", model, known.models), 2)
    if as_json:
        print(json.dumps(model_json(model, known), indent=1))
    else:
        _print(model_settings(model, known))


@app.command()
def maps() -> None:
    """List the environment maps."""
    from kernels.worlds import MAPS
    from sweep.cli.listing import map_table

    _print(map_table(), MAPS)


@app.command()
def metrics() -> None:
    """List the metrics, with units and sources."""
    from kernels.metrics import METRICS
    from sweep.cli.listing import metric_table

    _print(metric_table(), METRICS)


@app.command()
def schema(
    spec: Annotated[
        Path | None,
        typer.Option(
            help="The schema of this spec, with the models, metrics, maps and starts"
            " that files beside it bring. These files run."
        ),
    ] = None,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Print the JSON Schema of a spec, with which editors check and complete it."""
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
