"""Commands that say what exists."""

from typing import Annotated, Any

import typer

from sweep.cli.app import app, stop


@app.command()
def models(
    name: Annotated[
        str | None, typer.Argument(help="A model, for all its settings.")
    ] = None,
) -> None:
    """The models, or the settings of one with units, ranges and preset values."""
    from sweep.cli.listing import model_settings, model_table

    _print(
        model_table()
        if name is None
        else model_settings(_known(name, "model", _models()))
    )


@app.command()
def maps() -> None:
    """The environment maps."""
    from sweep.cli.listing import map_table

    _print(map_table())


@app.command()
def metrics() -> None:
    """The metrics, with units and sources."""
    from sweep.cli.listing import metric_table

    _print(metric_table())


@app.command()
def schema() -> None:
    """The JSON Schema of a spec, with which editors check and complete it."""
    import json

    from sweep.spec.schema import json_schema

    print(json.dumps(json_schema(), indent=1))


def _models() -> list[str]:
    from kernels.models import MODELS

    return list(MODELS)


def _known(name: str, what: str, names: list[str]) -> str:
    from sweep.text import unknown

    if name not in names:
        stop(unknown(what, name, names), 2)
    return name


def _print(renderable: Any) -> None:
    from sweep.cli.terminal import console

    console().print(renderable)
