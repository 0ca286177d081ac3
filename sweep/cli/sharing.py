"""Commands that share a study: one file, a citation, a description."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import (
    CodeFrom,
    Force,
    Json,
    NoCode,
    Results,
    StudyName,
    Trust,
    app,
    one_format,
)


@app.command()
def pack(
    study: StudyName,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to", help="The .zip file; by default the study's name in this folder."
        ),
    ] = None,
    force: Force = False,
    results: Results = Path("results"),
) -> None:
    """Write a stored study into one file, which others can read without boidsweep.

    It has its tables, spec, code, origin, citation and checksums.
    """
    from sweep.design import size
    from sweep.sharing import pack as write
    from sweep.tables import StoredStudy

    done = write(StoredStudy(study, results), to, force=force)
    print(f"{done.path}: {size(done.size_bytes)}", file=sys.stderr)
    if done.apart:
        print(
            f"it has {done.apart:,} trials too that are not of the spec as last"
            f" launched; sweep gc {study} removes such",
            file=sys.stderr,
        )
    print(f"{done.sha256}  {done.path}")


@app.command()
def load(
    file: Annotated[Path, typer.Argument(help="A file that `sweep pack` has written.")],
    name: Annotated[
        str | None, typer.Option("--as", metavar="NAME", help="Call the study so.")
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to", help="Write its spec and code into this new folder, to launch."
        ),
    ] = None,
    results: Results = Path("results"),
) -> None:
    """Make a study of a packed file again, after a check of all of it.

    No code of the study runs.
    """
    from sweep.cli.spec_files import how_to_launch_on, what_the_spec_needs
    from sweep.sharing import check_new, lay_out, unpack
    from sweep.tables import StoredStudy

    if to:
        check_new(to)
    done = unpack(file, results, name)
    print(done.place)
    if done.own_code:
        print(
            f"trials are computed by code of the study: `sweep code {done.study}` shows"
            " it; where you have not launched it yourself it runs only with --trust",
            file=sys.stderr,
        )
    stored = StoredStudy(done.study, results)
    if to:
        laid = lay_out(stored, to)
        print(*laid.files, sep="\n")
        print(how_to_launch_on(stored, laid), file=sys.stderr)
    elif advice := what_the_spec_needs(stored):
        print(advice, file=sys.stderr)


@app.command()
def cite(
    study: Annotated[
        str | None,
        typer.Argument(metavar="STUDY", help="A stored study; none: the program."),
    ] = None,
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print BibTeX.")] = False,
    as_json: Json = False,
    results: Results = Path("results"),
) -> None:
    """Print what to cite: the program, and with a study more works.

    These are the work behind its model, and the study with a hash of its content.
    --json prints CSL, as Zotero and pandoc read it.
    """
    from sweep.sharing import cite as cited
    from sweep.tables import StoredStudy

    one_format(bibtex=bibtex, json=as_json)
    citation = cited(StoredStudy(study, results) if study else None)
    if bibtex:
        print(citation.as_bibtex())
    else:
        print(citation.as_json() if as_json else citation.as_text())


@app.command()
def odd(
    study: Annotated[
        str,
        typer.Argument(metavar="STUDY|SPEC", help="A stored study, or a .yaml file."),
    ],
    results: Results = Path("results"),
    trust: Trust = False,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Print an ODD description (Grimm et al. 2020) of a model and a study in Markdown.

    It is made of what the code and the spec say of themselves. What they do not say is
    a gap.
    """
    from sweep.design import expand
    from sweep.own_code import load_spec
    from sweep.sharing import odd as described
    from sweep.sharing import of_spec, of_stored
    from sweep.spec import SPEC_ENDINGS
    from sweep.tables import StoredStudy

    if study.endswith(SPEC_ENDINGS):
        spec = load_spec(Path(study), code=not no_code, code_from=code_from)
        facts = of_spec(spec, expand(spec))
    else:
        facts = of_stored(StoredStudy(study, results, trust=trust))
    print(described(facts), end="")
