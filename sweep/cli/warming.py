"""The command that compiles ahead."""

from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import CodeFrom, NoCode, Quiet, app
from sweep.cli.completing import model_names
from sweep.spec import SPEC_ENDINGS


@app.command()
def warm(
    sources: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MODEL | SPEC]...",
            help="Models, or files that have one, ./NAME.py; or specs. By default all"
            " models of `sweep models`.",
            autocompletion=model_names,
        ),
    ] = None,
    quiet: Quiet = False,  # noqa: ARG001
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Compile ahead what specs or models need, into the cache.

    Of a spec that is what its launch would compile, and of a model also all metrics
    that can be measured in it. Where everything is compiled it is only loaded.
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
