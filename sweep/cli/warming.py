"""The command that compiles ahead."""

from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import CodeFrom, Group, NoCode, Quiet, app
from sweep.cli.completing import model_names
from sweep.spec import SPEC_ENDINGS


@app.command(rich_help_panel=Group.run)
def warm(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MODEL | SPEC]...",
            help="Models, files with a model such as ./NAME.py, or specs; by default"
            " all models of `sweep models`.",
            autocompletion=model_names,
        ),
    ] = None,
    quiet: Quiet = False,  # noqa: ARG001
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Compile models or specs ahead of a launch.

    For a spec, compiles the code of its launch. For a model, also compiles all metrics
    that the model can have. The compiled code is in a cache, and code in the cache is
    only loaded.

    Examples
    --------
    sweep warm spec.yaml
    sweep warm nguyen2024 --quiet
    """
    from kernels.models import MODELS
    from sweep.campaigns import cache_folder, warm_model, warm_study
    from sweep.own_code import load_spec

    for source in sources or list(MODELS):
        if Path(source).suffix in SPEC_ENDINGS:
            study = load_spec(Path(source), code=not no_code, code_from=code_from)
            seconds = warm_study(study)
        else:
            seconds = warm_model(source, code=not no_code)
        print(f"{source}: ready after {seconds:.1f} s", flush=True)
    print(f"compiled code is in {cache_folder()}")
