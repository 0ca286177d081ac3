"""A certificate: trials and publications that ran again, and how the results compare.

A certificate is for readers of a paper. Packed studies are verified by a random sample
of trials. Claims of publications are judged with new trials, at the quick scale.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from sweep.campaigns import Display
from sweep.errors import ChoiceError, OutputError, UserError
from sweep.published import FILE, read_all, reproduce
from sweep.replays import Verification, upper_bound, verify
from sweep.sharing.unpacking import unpack
from sweep.store import machine, replacing
from sweep.tables import StoredStudy, sha256
from sweep.text import so_many
from sweep.workers import ExecutorFactory

FORMAT = 1
FILES = "certificate.json", "certificate.md", "badge.svg"
GREEN = "#1b6e34"
RED = "#a4262c"
DIGIT_WIDTH = 7.0
"""Width of a character of the badge in pixels, at 11 px."""
VERIFIED = "packed study", "stored trials", "run again", "bitwise identical", "note"
JUDGED = "publication", "statements by verdict"
Progress = Callable[[int, int], None]


class PackedSample(NamedTuple):
    """Size and seed of a random sample of stored trials."""

    fraction: float
    most: int
    seed: int


class RepeatedSources(NamedTuple):
    """Packed studies, and folders of publications."""

    packed: Sequence[Path]
    folders: Sequence[Path]


@dataclass(frozen=True)
class VerifiedStudy:
    """A packed study, of which a sample of trials ran again.

    Attributes
    ----------
    file, sha256 : str
        Name and hash of the packed file.
    study : str
        Name of the study.
    stored, checked, identical : int
        Numbers of stored trials that can be compared, of trials that ran again, and of
        trials with bitwise identical results.
    differing_at_most : float
        Upper bound for the fraction of trials that differ, with 95 % confidence.
    seed : int
        Seed of the sample.
    computed_by : dict of str to int
        Numbers of trials by the processor and the versions of the stored run.
    error : str
        Reason why nothing was compared, or "".
    """

    file: str
    sha256: str
    study: str = ""
    stored: int = 0
    checked: int = 0
    identical: int = 0
    differing_at_most: float = 1.0
    seed: int = 0
    computed_by: Mapping[str, int] | None = None
    error: str = ""


@dataclass(frozen=True)
class JudgedPublication:
    """A publication whose claims were judged at the quick scale.

    Attributes
    ----------
    study : str
        Name of the folder.
    statements : dict of str to int
        Numbers of statements by verdict.
    """

    study: str
    statements: Mapping[str, int]


@dataclass(frozen=True)
class Certificate:
    """Results of all repetitions.

    Attributes
    ----------
    time : str
        Time of the certificate, in UTC.
    machine : dict
        Versions of packages, system and processor.
    studies : tuple of VerifiedStudy
    publications : tuple of JudgedPublication
    failures : tuple of str
        Trials, figures and measures of publications that failed.
    """

    time: str
    machine: Mapping[str, Any]
    studies: tuple[VerifiedStudy, ...]
    publications: tuple[JudgedPublication, ...]
    failures: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """True if all compared trials are identical, and nothing failed.

        A refuted claim is a result, not a failure.
        """
        identical = all(
            not study.error and study.identical == study.checked
            for study in self.studies
        )
        return identical and not self.failures

    @property
    def summary(self) -> str:
        """The results in a few words, for a badge."""
        phrases = []
        if self.studies:
            checked = sum(study.checked for study in self.studies)
            identical = sum(study.identical for study in self.studies)
            phrases.append(f"{identical:,} of {so_many(checked, 'trial')} identical")
        if errors := sum(bool(study.error) for study in self.studies):
            phrases.append(f"{so_many(errors, 'file')} not compared")
        for verdict in ("confirmed", "refuted"):
            count = sum(
                publication.statements.get(verdict, 0)
                for publication in self.publications
            )
            if count:
                phrases.append(f"{so_many(count, 'claim')} {verdict}")
        if self.failures:
            phrases.append(f"{len(self.failures):,} failed")
        return ", ".join(phrases) or "no claim judged"

    def as_json(self) -> str:
        """Return the certificate as JSON; docs/guide/certificates.md has the keys."""
        content = {
            "version": FORMAT,
            "passed": self.passed,
            "summary": self.summary,
            **asdict(self),
        }
        return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"

    def as_markdown(self) -> str:
        """Return the certificate as Markdown."""
        versions = self.machine["versions"]
        listed = ", ".join(
            f"{name} {version}" for name, version in versions.items() if version
        )
        lines = [
            "# Certificate of reproduction",
            "",
            f"**{'Passed' if self.passed else 'Failed'}:** {self.summary}.",
            "",
            f"- Time: {self.time}",
            f"- Machine: {self.machine['cpu']}, {self.machine['platform']}",
            f"- Versions: {listed}",
        ]
        if self.studies:
            lines += ["", *_table(VERIFIED, map(_verified, self.studies))]
        if self.publications:
            lines += ["", *_table(JUDGED, map(_judged, self.publications))]
        lines += ["", *(f"- Failed: {failure}" for failure in self.failures)]
        return "\n".join(lines).rstrip() + "\n"

    def as_badge(self) -> str:
        """Return the summary as a picture in SVG."""
        colour = GREEN if self.passed else RED
        label = "boidsweep"
        left = len(label) * DIGIT_WIDTH + 10
        width = left + len(self.summary) * DIGIT_WIDTH + 10
        title = escape(f"{label}: {self.summary}")
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="20"'
            f' role="img" aria-label="{title}"><title>{title}</title>'
            f'<rect width="{width:g}" height="20" rx="3" fill="{colour}"/>'
            f'<path d="M3 0H{left:g}V20H3a3 3 0 0 1-3-3V3a3 3 0 0 1 3-3" fill="#444"/>'
            '<g fill="#fff" font-family="Verdana,DejaVu Sans,sans-serif"'
            ' font-size="11" text-anchor="middle">'
            f'<text x="{left / 2:g}" y="14">{label}</text>'
            f'<text x="{(left + width) / 2:g}" y="14">{escape(self.summary)}</text>'
            "</g></svg>\n"
        )

    def write(self, folder: Path, *, force: bool = False) -> list[Path]:
        """Write FILES, and return their paths.

        Parameters
        ----------
        folder : Path
            New or existing folder.
        force : bool, default False
            Whether to replace existing files.

        Raises
        ------
        OutputError
            If a file exists already, or cannot be written.
        """
        check_free(folder, force=force)
        paths = [folder / name for name in FILES]
        contents = self.as_json(), self.as_markdown(), self.as_badge()
        try:
            folder.mkdir(parents=True, exist_ok=True)
            for path, content in zip(paths, contents, strict=True):
                with replacing(path) as file:
                    file.write(content.encode())
        except OSError as error:
            raise OutputError(f"{folder}: {error.strerror or error}") from error
        return paths


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    """Yield the lines of a table in Markdown."""
    yield f"| {' | '.join(headings)} |"
    yield "|" + " --- |" * len(headings)
    for row in rows:
        cells = (" ".join(cell.replace("|", "\\|").split()) for cell in row)
        yield f"| {' | '.join(cells)} |"


def check_free(folder: Path, *, force: bool = False) -> None:
    """Raise OutputError if a file of a certificate exists already.

    Parameters
    ----------
    folder : Path
    force : bool, default False
        Whether existing files may be replaced.
    """
    existing = [name for name in FILES if (folder / name).exists()]
    if existing and not force:
        raise OutputError(
            f"{folder / existing[0]} exists already; --force replaces it, and --to"
            " names another folder"
        )


def sources_of(paths: Sequence[Path]) -> RepeatedSources:
    """Return the packed studies and the folders of publications among paths.

    Parameters
    ----------
    paths : sequence of Path

    Raises
    ------
    ChoiceError
        If a path is neither; the message has all such paths.
    """
    packed = [path for path in paths if path.is_file()]
    folders = [path for path in paths if any(path.glob(f"*/{FILE}"))]
    neither = [path for path in paths if path not in {*packed, *folders}]
    if neither:
        reasons = [
            f"{path}: {'no folder in it has a ' + FILE if path.is_dir() else 'no file'}"
            for path in neither
        ]
        allowed = f"a file of `sweep pack`, or a folder of studies with a {FILE}"
        raise ChoiceError("\n  ".join([f"allowed: {allowed}", *reasons]))
    return RepeatedSources(packed, folders)


def certify(
    sources: RepeatedSources,
    results: Path,
    engine: ExecutorFactory,
    *,
    sample: PackedSample,
    trust: bool,
    display: Callable[[str], Display],
    progress: Callable[[str], Progress],
) -> Certificate:
    """Verify packed studies, reproduce publications, and return a certificate.

    Parameters
    ----------
    sources : RepeatedSources
        Result of `sources_of`.
    results : Path
        Folder for trials, figures and the scorecard of the publications.
    engine : ExecutorFactory
        Runs the trials.
    sample : PackedSample
        The trials of each packed study that run again.
    trust : bool
        Whether custom code of packed studies may run.
    display : callable
        Makes the progress display of a launch, from the name of a study.
    progress : callable
        Makes the progress display of a verification, from the name of a file.

    Raises
    ------
    SpecError, StoreError
        If a publication cannot be read.
    """
    studies = [
        _verify(path, engine, sample=sample, trust=trust, progress=progress(path.name))
        for path in sources.packed
    ]
    publications: list[JudgedPublication] = []
    failures: list[str] = []
    for folder in sources.folders:
        outcome = reproduce(
            read_all(folder, quick=True), results, engine, display, quick=True
        )
        publications += [
            JudgedPublication(
                name, {str(key): count for key, count in statements.items()}
            )
            for name, statements in outcome.statements.items()
        ]
        failures += outcome.failures
        if outcome.not_done:
            failures.append(f"{so_many(outcome.not_done, 'trial')} not done")
    return Certificate(
        time=datetime.now(UTC).isoformat(timespec="seconds"),
        machine=machine(),
        studies=tuple(studies),
        publications=tuple(publications),
        failures=tuple(failures),
    )


def _verify(
    path: Path,
    engine: ExecutorFactory,
    *,
    sample: PackedSample,
    trust: bool,
    progress: Progress,
) -> VerifiedStudy:
    """Load a packed study into a temporary folder, and run a sample again."""
    file = path.name
    digest = sha256(path)
    with TemporaryDirectory(prefix="boidsweep-certificate-") as folder:
        try:
            study = unpack(path, Path(folder)).study
            done = verify(
                StoredStudy(study, Path(folder), trust=trust),
                engine,
                fraction=sample.fraction,
                most=sample.most,
                seed=sample.seed,
                report=progress,
            )
        except ChoiceError:
            raise  # the options are wrong, not the study
        except UserError as error:
            return VerifiedStudy(file, digest, error=str(error))
    return _verified_study(file, digest, done)


def _verified_study(file: str, digest: str, done: Verification) -> VerifiedStudy:
    checked = done.checked.total()
    differing = len(done.differing)
    every = checked == done.stored
    return VerifiedStudy(
        file,
        digest,
        study=done.study,
        stored=done.stored,
        checked=checked,
        identical=checked - differing,
        differing_at_most=(
            differing / checked if every else upper_bound(checked, differing)
        ),
        seed=done.seed,
        computed_by=dict(done.origins),
    )


def _verified(study: VerifiedStudy) -> list[str]:
    """Return the row of a packed study."""
    if study.error:
        return [study.file, "", "", "", study.error]
    note = f"at most {100 * study.differing_at_most:.3g} % of all trials differ (95 %)"
    return [
        f"{study.study} ({study.file})",
        f"{study.stored:,}",
        f"{study.checked:,}",
        f"{study.identical:,}",
        note,
    ]


def _judged(publication: JudgedPublication) -> list[str]:
    """Return the row of a publication."""
    counts = sorted(publication.statements.items())
    verdicts = ", ".join(f"{count:,} {verdict}" for verdict, count in counts)
    return [publication.study, verdicts or "not compared with the publication"]
