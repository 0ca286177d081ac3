"""Commands that share a study: a file, a citation, a description."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import (
    CodeFrom,
    Force,
    Group,
    Json,
    NoCode,
    Results,
    StudyName,
    Trust,
    Workers,
    app,
    one_format,
    stop,
)


@app.command(rich_help_panel=Group.store)
def pack(
    study: StudyName,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to", help="File to write, .zip; by default the name of the study."
        ),
    ] = None,
    force: Force = False,
    results: Results = Path("results"),
) -> None:
    """Pack a stored study into one ZIP file.

    The file contains tables, spec, code, provenance, citation and checksums, and is
    readable without boidsweep.

    Examples
    --------
    sweep pack my/first
    sweep pack my/first --to first.zip --force
    """
    from sweep.design import size
    from sweep.sharing import pack as write
    from sweep.tables import StoredStudy

    done = write(StoredStudy(study, results), to, force=force)
    print(f"{done.path}: {size(done.size_bytes)}", file=sys.stderr)
    if done.apart:
        print(
            f"the file also has {done.apart:,} trials that are not in the last launched"
            f" spec; sweep gc {study} removes such trials from the study",
            file=sys.stderr,
        )
    print(f"{done.sha256}  {done.path}")


@app.command(rich_help_panel=Group.store)
def load(
    file: Annotated[Path, typer.Argument(help="File that `sweep pack` has written.")],
    name: Annotated[
        str | None,
        typer.Option("--as", metavar="NAME", help="Store the study under this name."),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to", help="New folder for the spec and the code, ready for a launch."
        ),
    ] = None,
    results: Results = Path("results"),
) -> None:
    """Load a packed study into a results folder.

    Checks the whole file first. No code of the study runs.

    Examples
    --------
    sweep load first.zip
    sweep load first.zip --as their/first --to received
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
            f"custom code computes the trials: sweep code {done.study} shows the code."
            " Unless you have launched the study, the code runs only with --trust",
            file=sys.stderr,
        )
    stored = StoredStudy(done.study, results)
    if to:
        laid = lay_out(stored, to)
        print(*laid.files, sep="\n")
        print(how_to_launch_on(stored, laid), file=sys.stderr)
    elif advice := what_the_spec_needs(stored):
        print(advice, file=sys.stderr)


@app.command(rich_help_panel=Group.store)
def cite(
    study: Annotated[
        str | None,
        typer.Argument(
            metavar="STUDY", help="Stored study; by default the program alone."
        ),
    ] = None,
    bibtex: Annotated[bool, typer.Option("--bibtex", help="Print BibTeX.")] = False,
    as_json: Json = False,
    results: Results = Path("results"),
) -> None:
    """Print citations of the program, the model and a study.

    The citation of the model is the publication behind the model. The citation of the
    study has a hash of the content. With --json, prints CSL for Zotero and pandoc.

    Examples
    --------
    sweep cite
    sweep cite my/first --bibtex
    """
    from sweep.sharing import cite as cited
    from sweep.tables import StoredStudy

    one_format(bibtex=bibtex, json=as_json)
    citation = cited(StoredStudy(study, results) if study else None)
    if bibtex:
        print(citation.as_bibtex())
    else:
        print(citation.as_json() if as_json else citation.as_text())


@app.command(rich_help_panel=Group.store)
def register(
    study: Annotated[
        str,
        typer.Argument(
            metavar="SPEC|STUDY",
            help="Spec (.yaml) of one study; with --check a stored study.",
        ),
    ],
    check: Annotated[
        Path | None,
        typer.Option(
            "--check",
            metavar="FILE",
            help="Registration with which to compare the stored study.",
        ),
    ] = None,
    claim: Annotated[
        list[str] | None,
        typer.Option(help="Expected result, in a sentence; may be repeated."),
    ] = None,
    to: Annotated[
        Path | None,
        typer.Option("--to", help="New file, .yaml; by default the name of the study."),
    ] = None,
    results: Results = Path("results"),
    as_json: Json = False,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Register a study before its first trial.

    Writes a dated file with the spec, the plan, the claims, and hashes of the code.
    With --check, compares a stored study with such a file; the exit code is 1 if a fact
    differs. A registration is never replaced.

    Examples
    --------
    sweep register spec.yaml --claim "The speed falls with the separation weight."
    sweep register my/first --check my-first-registration.yaml
    """
    from sweep.campaigns import plan_of
    from sweep.cli.spec_files import check_spec_file
    from sweep.own_code import load_spec
    from sweep.sharing import check_registration
    from sweep.sharing import register as write
    from sweep.tables import StoredStudy
    from sweep.workers import worker_count

    if check:
        if claim or to or no_code or code_from:
            stop(
                "--check: reads a registration; leave out --claim, --to, --no-code and"
                " --code-from"
            )
        done = check_registration(check, StoredStudy(study, results))
    else:
        spec = Path(study)
        check_spec_file(spec, results)
        parsed = load_spec(spec, code=not no_code, code_from=code_from)
        plan = plan_of(parsed, worker_count(0), results)
        done = write(parsed, plan, results, claims=claim or (), path=to)
        print(done.path, file=sys.stderr)
    print(done.as_json() if as_json else done.as_text())
    if done.agrees is False:
        raise SystemExit(1)


@app.command(rich_help_panel=Group.store)
def certify(
    sources: Annotated[
        list[Path],
        typer.Argument(
            metavar="SOURCE...",
            help="File of `sweep pack`, or folder of studies with a published.yaml.",
        ),
    ],
    to: Annotated[
        Path, typer.Option("--to", help="Folder for the certificate and the badge.")
    ] = Path("certificate"),
    fraction: Annotated[
        float,
        typer.Option(help="Fraction of the trials of a packed study, from 0 to 1."),
    ] = 0.01,
    most: Annotated[
        int, typer.Option(min=1, help="Maximum number of trials of a packed study.")
    ] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random sample.")] = 0,
    force: Force = False,
    trust: Trust = False,
    results: Results = Path("results"),
    workers: Workers = 0,
) -> None:
    """Verify packed studies, judge claims, write a badge.

    Runs a random sample of the trials of each packed study again, and compares bit for
    bit. Reproduces the publications of a folder at the quick scale; this runs
    figures.py of each study. The exit code is 1 if a trial differs or a run fails. A
    refuted claim is a result, and no failure.

    Examples
    --------
    sweep certify my-first.zip
    sweep certify my-first.zip experiments --most 20 --to certificate
    """
    from sweep.cli.progress import ProgressBar
    from sweep.cli.progress_line import ProgressLine
    from sweep.published import code_files
    from sweep.sharing import PackedSample, check_free, sources_of
    from sweep.sharing import certify as run_again
    from sweep.store import local_folder
    from sweep.workers import Loky, worker_count

    requested = sources_of(sources)
    check_free(to, force=force)
    folder = local_folder(results, "figures of publications are written to")
    code = [file for place in requested.folders for file in code_files(place, ())]
    if code:
        print(f"this runs code: {', '.join(map(str, code))}", file=sys.stderr)
    certificate = run_again(
        requested,
        folder,
        Loky(worker_count(workers)),
        sample=PackedSample(fraction, most, seed),
        trust=trust,
        display=ProgressBar,
        progress=lambda file: ProgressLine(file, "trials compared").show,
    )
    paths = certificate.write(to, force=force)
    print(certificate.as_markdown(), end="")
    print(*paths, sep="\n", file=sys.stderr)
    if not certificate.passed:
        raise SystemExit(1)


@app.command(rich_help_panel=Group.store)
def odd(
    study: Annotated[
        str,
        typer.Argument(metavar="STUDY|SPEC", help="Stored study, or spec (.yaml)."),
    ],
    results: Results = Path("results"),
    trust: Trust = False,
    no_code: NoCode = False,
    code_from: CodeFrom = None,
) -> None:
    """Write a draft ODD protocol (Grimm et al. 2020).

    Prints Markdown about a model and a study, from the docstrings of the code and from
    the spec. The last chapter lists the gaps that you have to fill.

    Examples
    --------
    sweep odd my/first
    sweep odd spec.yaml --no-code
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
