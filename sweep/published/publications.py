"""Publications: `published.yaml`, next to the specs of a study, is read and checked.

A publication has specs that test the claims. A figures.py has the figures, and the
functions that claims call. At the quick scale, each spec has the changes that the file
lists. Results of the quick scale are stored under another name.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sweep.design import Design, expand
from sweep.errors import SpecError
from sweep.figures import NAME, Drawing
from sweep.own_code import check_spec, code_of, load_spec, study_of
from sweep.published.bibliography import BIBLIOGRAPHIC, FILE, bibliography
from sweep.published.claims import Claim, read_claims
from sweep.published.measures import MeasureReader
from sweep.published.program_mutants import PROGRAM_MUTANTS
from sweep.published.published_code import (
    CODE,
    check_drawings,
    files_of_code,
    run_code,
)
from sweep.spec import Entry, Study, read_document
from sweep.text import unknown

FULL = "full"
QUICK = "quick"
MUTANTS = "mutants"
FIXED = "fixed"
ALL = "all"
"""Key of the changes of a mutant to every spec of a publication."""


@dataclass(frozen=True)
class Contradiction:
    """A place with a contradiction within a publication, or with its data."""

    where: str
    says: str


@dataclass(frozen=True)
class Mutant:
    """A wrong version of the studies of a publication, which claims must detect.

    Attributes
    ----------
    name : str
    description : str
        Mistake in words.
    changes : mapping of str to sequence of Entry
        Changes by spec, in the format of the quick scale.
    """

    name: str
    description: str
    changes: Mapping[str, Sequence[Entry]]


@dataclass(frozen=True)
class Publication:
    """A publication: claims, figures, and the studies for the tests, by spec.

    The code of a publication that is not `selected` is not run. Such a publication has
    no figures, and the claims have no measures. `clocks` has entries for studies with a
    shorter time step: by spec, the number of short steps per step of the claims and
    functions.
    """

    folder: Path
    title: str
    source: str
    studies: Mapping[str, Study]
    claims: Sequence[Claim]
    mutants: Sequence[Mutant]
    contradictions: Sequence[Contradiction]
    drawings: Mapping[str, Drawing]
    functions: Mapping[str, Callable[..., Any]]
    selected: bool
    clocks: Mapping[str, int] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name

    @property
    def family(self) -> int:
        """Number of counted claims, which need simultaneous verdicts."""
        return sum(claim.counted for claim in self.claims)


def code_files(experiments: Path, only: Collection[str] = ()) -> list[Path]:
    """Return the files whose code `read_all` runs.

    Raises SpecError.
    """
    selected = [file for file in _files(experiments, only) if _is_selected(file, only)]
    drawing = [
        file.with_name(CODE) for file in selected if file.with_name(CODE).exists()
    ]
    of_figures = [code for file in drawing for code in files_of_code(file)]
    own = [code for file in selected for spec in _specs(file) for code in _code(spec)]
    return list(dict.fromkeys([*of_figures, *own]))


def _code(spec: Path) -> list[Path]:
    """Return the files that a spec runs; empty for a spec that is not valid."""
    try:
        return code_of(spec)
    except SpecError:
        return []


def _specs(file: Path) -> list[Path]:
    """Return the specs next to a published.yaml, in the order of names."""
    return sorted(path for path in file.parent.glob("*.yaml") if path.name != FILE)


def read_all(
    experiments: Path,
    *,
    quick: bool,
    only: Collection[str] = (),
) -> list[Publication]:
    """Return the publications of the folders in `experiments`, by name.

    Parameters
    ----------
    experiments : Path
        Folder with one folder per publication.
    quick : bool
        Read the quick scale instead of the full scale.
    only : collection of str, default ()
        Folders to select; () for all. The code of other folders is not run, and claims
        of other folders are not tested.

    Raises
    ------
    SpecError
        One error with the first mistake of every claim and file, with file and line.
    """
    publications = []
    mistakes = []
    for file in _files(experiments, only):
        selected = _is_selected(file, only)
        try:
            publications.append(read_publication(file, quick=quick, selected=selected))
        except SpecError as error:
            mistakes += [
                f"{file.parent.name}/{line}" for line in str(error).splitlines()
            ]
    owners: dict[str, str] = {}
    for publication in publications:
        for spec, study in publication.studies.items():
            place = f"{publication.name}/{spec}.yaml"
            if study.name in owners:
                mistakes.append(
                    f'{place}: study "{study.name}" is already the study of'
                    f" {owners[study.name]}"
                )
            owners[study.name] = place
    if mistakes:
        raise SpecError("\n".join(mistakes))
    return publications


def read_without_code(experiments: Path) -> list[Publication]:
    """Return all publications, by name, without a run of any code.

    `experiments` has one folder per publication. Raises SpecError.
    """
    return [
        read_publication(file, quick=False, selected=False)
        for file in _files(experiments, ())
    ]


def _files(experiments: Path, only: Collection[str]) -> list[Path]:
    files = sorted(experiments.glob(f"*/{FILE}"))
    if not files:
        raise SpecError(f"{experiments}: no subfolder has a {FILE}")
    for file in files:
        for path in (*file.parent.glob("*.yaml"), file.with_name(CODE)):
            if path.exists() and not path.is_file():  # reading a pipe would never end
                raise SpecError(f"{path}: not an ordinary file")
    names = [file.parent.name for file in files]
    for name in only:
        if name not in names:
            raise SpecError(unknown("study folder", name, names))
    return files


def _is_selected(file: Path, only: Collection[str]) -> bool:
    return not only or file.parent.name in only


def read_publication(
    file: Path, *, quick: bool, selected: bool = True, mutant: str | None = None
) -> Publication:
    """Return the publication of a `published.yaml`.

    Parameters
    ----------
    file : Path
        The published.yaml.
    quick : bool
        Read the quick scale instead of the full scale.
    selected : bool, default True
        Run the code of the publication.
    mutant : str, optional
        Name of a mutant. The specs have the changes of the mutant, and other names.

    Raises
    ------
    SpecError
        If the file, a spec or the code is not valid.
    """
    root = read_document(file)
    root.keys(
        [*BIBLIOGRAPHIC, "specs", "claims", "mutants", "contradictions"],
        required=["title", "source", "specs", "claims"],
    )
    paper = bibliography(root)
    specs = dict(root.child("specs").mapping())
    mutants = _mutants(root.get("mutants"), specs) if selected else []
    if mutant is None:
        _try_changes(mutants, specs, file.parent)
    wrong = next(
        (candidate.changes for candidate in mutants if candidate.name == mutant), {}
    )
    designs = {
        spec: _designed(entry, file.parent, quick, wrong.get(spec, ()), mutant=mutant)
        for spec, entry in specs.items()
        if selected or not _runs_code(file.with_name(f"{spec}.yaml"))
    }
    studies = {spec: study for spec, (study, _) in designs.items()}
    module = run_code(file.with_name(CODE)) if selected else {}
    drawings = check_drawings(module, studies)
    functions = {
        name: value
        for name, value in module.items()
        if callable(value) and not name.startswith("_")
    }
    reader = MeasureReader(designs, functions) if selected else None
    return Publication(
        folder=file.parent,
        title=paper.title,
        source=paper.source,
        studies=studies,
        claims=read_claims(root.child("claims"), drawings, reader),
        mutants=mutants,
        contradictions=_contradictions(root.get("contradictions")),
        drawings=drawings,
        functions=functions,
        selected=selected,
    )


def read_mutant(publication: Publication, mutant: str) -> Publication:
    """Return a mutant of the publication at the quick scale.

    Raises SpecError.
    """
    try:
        return read_publication(publication.folder / FILE, quick=True, mutant=mutant)
    except SpecError as error:
        lines = str(error).splitlines()
        place = f"{publication.name}/"
        raise SpecError(
            "\n".join(f"{place}{line}, as the mutant {mutant}" for line in lines)
        ) from None


def _runs_code(spec: Path) -> bool:
    return spec.is_file() and bool(_code(spec))


def _designed(
    entry: Entry, folder: Path, quick: bool, wrong: Sequence[Entry], mutant: str | None
) -> tuple[Study, Design]:
    """Return the study and the design of a spec.

    At the quick scale, or as a mutant, the spec is changed and has another name.
    """
    changes = [entry, *wrong] if quick else wrong
    if not changes:
        study = _study(entry, folder)
        return study, expand(study)
    study = _changed(entry, folder, changes, f"{MUTANTS}/{mutant}" if wrong else QUICK)
    try:
        return study, expand(study)
    except SpecError as error:
        raise _at_the_changes(changes[-1], entry.name, error) from None


def _study(entry: Entry, folder: Path) -> Study:
    """Return the study of the spec that `entry` names."""
    return load_spec(_spec_file(entry, folder))


def _spec_file(entry: Entry, folder: Path) -> Path:
    if not isinstance(entry.value, dict):
        raise entry.expected("a mapping; {} for a quick scale without changes")
    file = folder / f"{entry.name}.yaml"
    if not file.exists():
        names = [path.stem for path in _specs(folder / FILE)]
        raise entry.error(unknown("spec", entry.name, names))
    return file


def _changed(
    entry: Entry, folder: Path, changes: Sequence[Entry], prefix: str
) -> Study:
    """Return the study of a changed spec, under another name."""
    file = _spec_file(entry, folder)
    spec = _with_changes(file, changes, prefix)
    try:
        return study_of(spec, file)
    except SpecError as error:
        raise _at_the_changes(changes[-1], entry.name, error) from None


def _with_changes(file: Path, changes: Sequence[Entry], prefix: str) -> dict[str, Any]:
    """Return a spec with `changes`, under another name."""
    spec: dict[str, Any] = read_document(file).value
    for change in changes:
        for path in change.value:
            _change(spec, change.child(path), path.split("."))
    return spec | {"study": f"{prefix}/{spec['study']}"}


def _at_the_changes(entry: Entry, spec: str, error: SpecError) -> SpecError:
    """Return the error of a changed spec, with the line of the changes.

    The original line refers to the changed text, which is in no file.
    """
    text = "; ".join(str(mistake).split(": ", 1)[1] for mistake in error.mistakes)
    return entry.error(f"with these changes {spec}.yaml is wrong: {text}")


def _change(spec: dict[str, Any], entry: Entry, path: Sequence[str]) -> None:
    """Put the value of `entry` into `spec`.

    The section `fixed` is added if missing. In other paths, all keys except the last
    key must exist.
    """
    if path[0] == FIXED:
        spec.setdefault(FIXED, {})
    for key in path[:-1]:
        inner = spec.get(key)
        if not isinstance(inner, dict):
            names = [name for name, value in spec.items() if isinstance(value, dict)]
            raise entry.error(unknown("mapping in the spec", key, names))
        spec = inner
    spec[path[-1]] = entry.value


def _mutants(entry: Entry | None, specs: Mapping[str, Entry]) -> list[Mutant]:
    mutants = []
    for name, child in entry.mapping() if entry else ():
        if not NAME.fullmatch(name):
            raise child.error(
                f'"{name}" is not a name of letters, digits, "_", "-" and "."'
            )
        if name in PROGRAM_MUTANTS:
            raise child.error(f'"{name}" is the name of a mutant of the program')
        child.keys(["about", "change"], required=["about", "change"])
        changes: dict[str, list[Entry]] = {}
        for key, change in child.child("change").mapping():
            change.mapping()
            if key != ALL and key not in specs:
                raise change.error(unknown("spec", key, [*specs, ALL]))
            for spec in specs if key == ALL else [key]:
                changes.setdefault(spec, []).append(change)
        mutants.append(Mutant(name, child.child("about").text(), changes))
    return mutants


def _try_changes(
    mutants: Sequence[Mutant], specs: Mapping[str, Entry], folder: Path
) -> None:
    """Raise SpecError if the changes of a mutant do not give a valid spec."""
    for mutant in mutants:
        for spec, mutant_changes in mutant.changes.items():
            file = _spec_file(specs[spec], folder)
            changed = _with_changes(file, mutant_changes, f"{MUTANTS}/{mutant.name}")
            try:
                check_spec(changed, file)
            except SpecError as error:
                raise _at_the_changes(mutant_changes[-1], spec, error) from None


def _contradictions(entry: Entry | None) -> list[Contradiction]:
    contradictions = []
    for child in entry.entries() if entry else []:
        child.keys(["where", "says"], required=["where", "says"])
        contradictions.append(
            Contradiction(child.child("where").text(), child.child("says").text())
        )
    return contradictions
