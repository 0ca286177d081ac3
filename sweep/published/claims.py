"""What a document published. `published.yaml`, beside the specs of its study, says it.
This module reads the file and checks all of it.

A publication has specs that test its claims. Its figures.py has the figures, and
functions that claims call. At the quick scale each spec is changed as the file says,
and its results are stored under another name.
"""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Literal, cast, get_args

from sweep.design.design import Design, expand
from sweep.errors import SpecError
from sweep.figures import NAME, Drawing
from sweep.own_code.reading import code_of, study_of
from sweep.published.measures import Measure, MeasureReader, RankCorrelation
from sweep.published.published_code import (
    CODE,
    check_drawings,
    files_of_code,
    run_code,
)
from sweep.published.verdicts import Above, Below, Expectation, Value, Within
from sweep.spec.document import Entry
from sweep.spec.strict_yaml import read_document
from sweep.spec.study import Study
from sweep.text import unknown

FILE = "published.yaml"
NOT_ASKED = f"not asked for: its code, {CODE}, was not run"
QUICK = "quick"
MUTANTS = "mutants"
FIXED = "fixed"
ALL = "all"
"""The changes of a mutant to every spec of its document."""
ABOUT_CLAIM = ("id", "where", "says", "kind", "registered")
SHARE = re.compile(r"([0-9]+(?:\.[0-9]+)?) %")

Kind = Literal["number", "reading", "hypothesis", "fit"]
"""What a claim is: a number that the document prints, or that its own data have; our
reading of one of its sentences; a hypothesis of ours; a test of what was fitted to it.
"""
Looked = Literal["before", "after"]
"""When results of such trials were first seen: before or after the expectation was
fixed.
"""


@dataclass(frozen=True)
class Claim:
    """One published number or statement: where it stands, what it says, how it is
    measured and what is expected.

        kind          what it is
        statement     the name that claims on the same statement share
        registered    the day on which the expectation got its present form
        spec, figure  whose trials test it, and which figure shows it
        looked        when results were first seen
        alternatives  other expectations or measures that were tried; "" for none
        untestable    the reason why it cannot be tested. Such a claim has no measure,
                      no expectation and no look
    """

    id: str
    where: str
    says: str
    kind: Kind
    statement: str
    registered: date
    spec: str | None = None
    figure: str | None = None
    measure: Measure | None = None
    expect: Expectation | None = None
    looked: Looked | None = None
    alternatives: str = ""
    untestable: str = ""


@dataclass(frozen=True)
class Contradiction:
    """Where a document contradicts itself or its own data."""

    where: str
    says: str


@dataclass(frozen=True)
class Mutant:
    """A wrong version of the studies of a document. Claims that hold must notice it.

    name     its name
    about    what is wrong, in words
    changes  by spec what is changed, as the quick scale writes its changes
    """

    name: str
    about: str
    changes: Mapping[str, Sequence[Entry]]


@dataclass(frozen=True)
class Publication:
    """One document: its claims, its figures, and the studies that test it by the names
    of their specs.

    `tested` is the number of claims with a measure. If the publication is not `asked`
    for, its code is not run: then it has no figures, and its claims have no measures.
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
    tested: int
    asked: bool

    @property
    def name(self) -> str:
        """The name of its folder."""
        return self.folder.name


def code_files(experiments: Path, only: Collection[str] = ()) -> list[Path]:
    """The files whose code `read_all` runs. Raises SpecError."""
    asked = [file for file in _files(experiments, only) if _is_asked(file, only)]
    drawing = [file.with_name(CODE) for file in asked if file.with_name(CODE).exists()]
    found = [code for file in drawing for code in files_of_code(file)]
    own = [code for file in asked for spec in _specs(file) for code in _code(spec)]
    return list(dict.fromkeys([*found, *own]))


def _code(spec: Path) -> list[Path]:
    """The files that a spec runs; none of one that `read_all` cannot read."""
    try:
        return code_of(spec)
    except SpecError:
        return []


def _specs(file: Path) -> list[Path]:
    """The specs beside a published.yaml, in the order of their names."""
    return sorted(path for path in file.parent.glob("*.yaml") if path.name != FILE)


def read_all(
    experiments: Path,
    *,
    quick: bool,
    only: Collection[str] = (),
) -> list[Publication]:
    """The publications of the folders in `experiments`, by name, at the full or the
    quick scale.

    If `only` names folders, the code of all others is not run, and their claims are not
    tested.

    Raises one SpecError that lists the first mistake of every claim and every file,
    each with file and line.
    """
    publications, mistakes = [], []
    for file in _files(experiments, only):
        asked = _is_asked(file, only)
        try:
            publications.append(read_publication(file, quick=quick, asked=asked))
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
                    f'{place}: study "{study.name}" is that of {owners[study.name]}'
                    " already"
                )
            owners[study.name] = place
    if mistakes:
        raise SpecError("\n".join(mistakes))
    return publications


def _files(experiments: Path, only: Collection[str]) -> list[Path]:
    files = sorted(experiments.glob(f"*/{FILE}"))
    if not files:
        raise SpecError(f"{experiments}: no folder in it has a {FILE}")
    for file in files:
        for path in (*file.parent.glob("*.yaml"), file.with_name(CODE)):
            if path.exists() and not path.is_file():  # reading a pipe would never end
                raise SpecError(f"{path}: is no ordinary file")
    names = [file.parent.name for file in files]
    for name in only:
        if name not in names:
            raise SpecError(unknown("study folder", name, names))
    return files


def _is_asked(file: Path, only: Collection[str]) -> bool:
    return not only or file.parent.name in only


def read_publication(file: Path, *, quick: bool, asked: bool = True) -> Publication:
    """The publication of a `published.yaml`. Runs its code if it is `asked` for. Raises
    SpecError.
    """
    root = read_document(file)
    root.keys(
        ["title", "source", "specs", "claims", "mutants", "contradictions"],
        required=["title", "source", "specs", "claims"],
    )
    specs = dict(root.child("specs").mapping())
    mutants = _mutants(root.get("mutants"), file, specs) if asked else []
    designs = {
        spec: _designed(entry, file.parent, quick)
        for spec, entry in specs.items()
        if asked or not _runs_code(file.with_name(f"{spec}.yaml"))
    }
    studies = {spec: study for spec, (study, _) in designs.items()}
    module = run_code(file.with_name(CODE)) if asked else {}
    drawings = check_drawings(module, studies)
    functions = {
        name: value
        for name, value in module.items()
        if callable(value) and not name.startswith("_")
    }
    return Publication(
        folder=file.parent,
        title=root.child("title").text(),
        source=root.child("source").text(),
        studies=studies,
        claims=_claims(root.child("claims"), designs, drawings, functions, asked),
        mutants=mutants,
        contradictions=_contradictions(root.get("contradictions")),
        drawings=drawings,
        functions=functions,
        tested=sum("measure" in one.value for one in root.child("claims").entries()),
        asked=asked,
    )


def _runs_code(spec: Path) -> bool:
    return spec.is_file() and bool(_code(spec))


def _designed(entry: Entry, folder: Path, quick: bool) -> tuple[Study, Design]:
    """A spec's study and design. At the quick scale, those of the changed spec, under
    another name.
    """
    study = _changed(entry, folder, [entry], QUICK) if quick else _study(entry, folder)
    try:
        return study, expand(study)
    except SpecError as error:
        raise _told(entry, entry.name, error) if quick else error from None


def _study(entry: Entry, folder: Path) -> Study:
    """The study of the spec that `entry` names."""
    file = _spec_file(entry, folder)
    return study_of(read_document(file).document.text, file)


def _spec_file(entry: Entry, folder: Path) -> Path:
    if not isinstance(entry.value, dict):
        raise entry.expected("a mapping, {} where the quick scale changes nothing")
    file = folder / f"{entry.name}.yaml"
    if not file.exists():
        names = [path.stem for path in _specs(folder / FILE)]
        raise entry.error(unknown("spec", entry.name, names))
    return file


def _changed(
    entry: Entry, folder: Path, changes: Sequence[Entry], prefix: str
) -> Study:
    """The study of the spec that `entry` names, with `changes`, under another name."""
    file = _spec_file(entry, folder)
    root = read_document(file)
    for change in changes:
        for path in change.value:
            _change(root.value, change.child(path), path.split("."))
    name = f"{prefix}/{root.value['study']}"
    try:
        return study_of(root.value | {"study": name}, file)
    except SpecError as error:
        raise _told(changes[-1], entry.name, error) from None


def _told(entry: Entry, spec: str, error: SpecError) -> SpecError:
    """The error of a changed spec, with the line of its changes: its own line is in the
    changed text, which is in no file.
    """
    message = str(error).split(": ", 1)[1]
    return entry.error(f"with these changes {spec}.yaml is wrong: {message}")


def _change(spec: dict[str, Any], entry: Entry, path: Sequence[str]) -> None:
    """Put the value of `entry` into `spec`. A spec without `fixed` gets one; of other
    keys all but the last must be there.
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


def _claims(
    root: Entry,
    designs: Mapping[str, tuple[Study, Design]],
    drawings: Mapping[str, Drawing],
    functions: Mapping[str, Callable[..., Any]],
    asked: bool,
) -> list[Claim]:
    """All claims. Raises one SpecError with the first mistake of each."""
    reader, claims, mistakes = MeasureReader(designs, functions), [], []
    lines: dict[str, int] = {}
    for entry in root.entries():
        try:
            claim = _claim(entry, reader, drawings) if asked else _untested(entry)
            if claim.id in lines:
                raise entry.child("id").error(
                    f'"{claim.id}" stands twice, first as number {lines[claim.id]}'
                )
            lines[claim.id] = len(lines) + 1
            claims.append(claim)
        except SpecError as error:
            mistakes.append(str(error))
    if mistakes:
        raise SpecError("\n".join(mistakes))
    return claims


def _untested(entry: Entry) -> Claim:
    """A claim of a publication that was not asked for."""
    reason = entry.get("untestable")
    why = reason.text() if reason else NOT_ASKED
    return Claim(**_about(entry), untestable=why)


def _claim(
    entry: Entry, reader: MeasureReader, drawings: Mapping[str, Drawing]
) -> Claim:
    tested = ("measure", "expect", "looked")
    entry.keys(
        [
            *ABOUT_CLAIM,
            *("statement", "spec", "figure", *tested, "alternatives", "untestable"),
        ],
        required=ABOUT_CLAIM,
    )
    about = _about(entry)
    spec, figure, reason, others = (
        entry.get(key) for key in ("spec", "figure", "untestable", "alternatives")
    )
    chosen = spec.one_of("spec", reader.designs) if spec else None
    shown = figure.one_of("figure", drawings) if figure else None
    given = [key for key in tested if key in entry.value]
    if len(given) != (0 if reason else len(tested)):
        raise entry.error(
            'a claim needs either "measure", "expect" and "looked",'
            ' or "untestable" with the reason'
        )
    if reason:
        return Claim(**about, spec=chosen, figure=shown, untestable=reason.text())
    if chosen is None:
        raise entry.error('missing key "spec": whose trials test the claim')
    measure = reader.read(entry.child("measure"), chosen)
    looked = entry.child("looked").one_of("time of the look", get_args(Looked))
    return Claim(
        **about,
        spec=chosen,
        figure=shown,
        measure=measure,
        expect=_expectation(entry.child("expect"), measure),
        looked=cast(Looked, looked),
        alternatives=others.text() if others else "",
    )


def _about(entry: Entry) -> dict[str, Any]:
    """What every claim says about itself, tested or not."""
    statement = entry.get("statement") or entry.child("id")
    for name in (entry.child("id"), statement):
        if not NAME.fullmatch(name.text()):
            raise name.expected('a name of letters, digits, "_", "-" and "."')
    return {
        "id": entry.child("id").text(),
        "where": entry.child("where").text(),
        "says": entry.child("says").text(),
        "kind": entry.child("kind").one_of("kind of claim", get_args(Kind)),
        "statement": statement.text(),
        "registered": _day(entry.child("registered")),
    }


def _day(entry: Entry) -> date:
    try:
        return date.fromisoformat(entry.text())
    except ValueError:
        raise entry.expected("a day such as 2026-03-01") from None


def _expectation(entry: Entry, measure: Measure) -> Expectation:
    kinds = ("value", "above", "below", "within")
    entry.keys([*kinds, "rounding", "trials", "margin", "because"])
    given = [kind for kind in kinds if kind in entry.value]
    if len(given) != 1:
        raise entry.error(f"an expectation needs exactly one of {', '.join(kinds)}")
    if given == ["value"]:
        return _value(entry, measure)
    entry.keys(given)
    bound = entry.child(given[0])
    if given != ["within"]:
        return Above(bound.number()) if given == ["above"] else Below(bound.number())
    numbers = [child.number() for child in bound.entries()]
    if len(numbers) != 2 or numbers[0] >= numbers[1]:
        raise bound.expected("a list of two numbers, the smaller one first")
    return Within(*numbers)


def _value(entry: Entry, measure: Measure) -> Value:
    if ("margin" in entry.value) != ("because" in entry.value):
        raise entry.error('"margin" and "because", its reason, go together')
    trials, because = entry.get("trials"), entry.get("because")
    if trials and isinstance(measure, RankCorrelation):
        raise trials.error('"trials" has no meaning for a rank correlation')
    value = entry.child("value").number()
    return Value(
        value=value,
        rounding=_rounding(entry.get("rounding")),
        trials=trials.whole(1) if trials else None,
        margin=_margin(entry.get("margin"), value),
        because=because.text() if because else "",
    )


def _rounding(entry: Entry | None) -> float:
    number = entry.number() if entry else 0.0
    if entry and number < 0:
        raise entry.expected("a number from 0")
    return number


def _margin(entry: Entry | None, value: float) -> float | None:
    """A margin in the unit of `value`, which may be given as a share of it."""
    if entry is None:
        return None
    if isinstance(entry.value, str):
        share = SHARE.fullmatch(entry.value)
        if not share:
            raise entry.expected('a number, or a share of the value such as "5 %"')
        margin = float(share[1]) / 100.0 * abs(value)
    else:
        margin = entry.number()
    if margin <= 0.0:
        raise entry.error(
            f'"margin" must be more than 0, not {margin:g}; the value is {value:g}'
        )
    return margin


def _mutants(
    entry: Entry | None, file: Path, specs: Mapping[str, Entry]
) -> list[Mutant]:
    """The mutants. Every change is tried: it must leave a spec that is right."""
    found = []
    for name, child in entry.mapping() if entry else ():
        if not NAME.fullmatch(name):
            raise child.error(
                f'"{name}" is not a name of letters, digits, "_", "-" and "."'
            )
        child.keys(["about", "change"], required=["about", "change"])
        changes: dict[str, list[Entry]] = {}
        for key, change in child.child("change").mapping():
            change.mapping()
            if key != ALL and key not in specs:
                raise change.error(unknown("spec", key, [*specs, ALL]))
            for spec in specs if key == ALL else [key]:
                changes.setdefault(spec, []).append(change)
        for spec, made in changes.items():
            _changed(specs[spec], file.parent, made, f"{MUTANTS}/{name}")
        found.append(Mutant(name, child.child("about").text(), changes))
    return found


def _contradictions(entry: Entry | None) -> list[Contradiction]:
    found = []
    for child in entry.entries() if entry else []:
        child.keys(["where", "says"], required=["where", "says"])
        found.append(
            Contradiction(child.child("where").text(), child.child("says").text())
        )
    return found
