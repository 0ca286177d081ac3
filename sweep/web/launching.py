"""Launches that a page asks for: one spec, the file of which the user has named.

A page proposes a text for this file, and is told what its launch would change. If the
user then says so, the text is written, and `sweep launch` of the file runs as a process
of its own. The process has no terminal, and ends with neither the page nor this server.
"""

import difflib
import hashlib
import shlex
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from kernels.catalogue import BUILT_IN, Catalogue
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import ChoiceError
from sweep.own_code.catalogue import OwnCatalogue
from sweep.own_code.reading import load_spec, study_with
from sweep.spec.study import Study
from sweep.spec.study_folder import SPEC
from sweep.store.locations import Location
from sweep.store.lock import Lock
from sweep.store.places import place_of
from sweep.tables.outputs import unfinished
from sweep.tables.spec_difference import compare
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many, unknown

NOBODY = "This page only reads: --launch SPEC lets it launch."
LAST_CHARACTERS = 2000
"""Of what a launch has said, which a page is told."""
PROCESS = (sys.executable, "-P", "-c", "from sweep.cli import main; main()")


class Proposal(NamedTuple):
    """What a launch of a text would change.

    text        of the spec
    file        in which it would be written, "" for none
    lines       what it changes of the text there is, as a unified difference
    difference  what `sweep diff` says of it; of a new study, how many trials it has
    to_run      trials that are not stored yet
    command     the command that launches it, after it is written
    seen        stands for the content of the file that the lines are about
    why_not     why the page cannot launch it, "" where it can
    """

    text: str
    file: str
    lines: str
    difference: str
    to_run: int
    command: str
    seen: str
    why_not: str


class StartedLaunch(NamedTuple):
    """A launch that was started here, and what it says on stderr."""

    study: str
    process: "subprocess.Popen[bytes]"
    said: BinaryIO


class Launcher:
    """Launches the spec in one file into one place of results. Any thread may ask.

        file     the file, which may come to be
        results  where its trials are stored
        options  further words of the command
        known    what names in a proposed text stand for where there is no file yet; a
                 text names no other code
        read     reads the spec in the file, where there is one

    Raises SpecError where the file has a spec that cannot be, and ChoiceError where it
    is a link.
    """

    def __init__(
        self,
        file: Path,
        results: Location,
        options: Sequence[str] = (),
        *,
        known: Catalogue = BUILT_IN,
        read: Callable[[Path], Study] = load_spec,
    ) -> None:
        self.file, self.results, self._options = file, results, tuple(options)
        self._known, self._read = known, read
        self._lock = threading.Lock()
        self.started: StartedLaunch | None = None
        if file.is_symlink():
            raise ChoiceError(f"--launch {file}: is a link; name the file it leads to")
        if not file.parent.is_dir():
            raise ChoiceError(f"--launch {file}: there is no folder {file.parent}")
        study = self.now()
        self.study = study.name if study else ""

    def now(self) -> Study | None:
        """The study in the file as it is now. Raises as `load_spec`."""
        return self._read(self.file) if self.file.exists() else None

    def proposed(self, text: str) -> Proposal:
        """What a launch of this text would change. Raises as `compare`."""
        return self._proposed(text)[0]

    def _proposed(self, text: str) -> tuple[Proposal, Study]:
        there = self.now()
        study = study_with(text, self.file, there.known if there else self._known)
        seen = _sha256(there.text) if there else ""
        proposal = proposed(
            study, there.text if there else "", self.results, self._options
        )
        return proposal._replace(seen=seen, why_not=self._why_not(study)), study

    def _why_not(self, study: Study) -> str:
        """Why a study cannot be launched now; "" where it can."""
        owners = Lock(place_of(self.results / study.name, self.results)).owners()
        if self.running:
            return "A launch that was started here is still running."
        if owners:
            return f"It is being launched, by {', '.join(owners)}."
        return ""

    @property
    def running(self) -> bool:
        """Whether a launch that was started here goes on."""
        return self.started is not None and self.started.process.poll() is None

    def launch(self, text: str, seen: str) -> dict[str, Any]:
        """Write a proposed text into the file and launch it; the state then.

        `seen` is that of the proposal. Raises ChoiceError where the file has changed
        since, or the study is being launched, OutputError where the file cannot be
        written, and as `proposed`.
        """
        with self._lock:
            proposal, study = self._proposed(text)
            if proposal.seen != seen:
                raise ChoiceError(
                    f"{self.file}: has changed since this page has read it; look at"
                    " the change again"
                )
            if proposal.why_not:
                raise ChoiceError(proposal.why_not, study.name)
            with unfinished(self.file) as file:
                file.write(text.encode())
            if self.started:
                self.started.said.close()
            self.started = self._start(study)
        return self.state()

    def _start(self, study: Study) -> StartedLaunch:
        own = isinstance(study.known, OwnCatalogue)
        words = [*_words(self.file, self.results, self._options), "--quiet"]
        words += [] if own else ["--no-code"]
        said = tempfile.TemporaryFile()  # noqa: SIM115 - as long as its launch
        process = subprocess.Popen(
            [*PROCESS, *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=said,
            start_new_session=True,
        )
        return StartedLaunch(study.name, process, said)

    def stop(self) -> dict[str, Any]:
        """Stop a launch that was started here: what is done stays stored."""
        with self._lock:
            if self.started and self.running:
                self.started.process.terminate()
        return self.state()

    def state(self) -> dict[str, Any]:
        """The file, and of the launch that was started here its study, its process,
        whether it goes on, its exit code and what it has said.
        """
        one = self.started
        if one is None:
            return {"file": str(self.file), "started": None}
        code = one.process.poll()
        about = {"study": one.study, "process": one.process.pid, "code": code}
        said = _last(one.said) if code and not one.said.closed else ""
        return {"file": str(self.file), "started": about | {"said": said}}

    def leave(self) -> str:
        """Let go of what was started here; what the user is told of a launch that goes
        on, "" where none does.
        """
        if self.started:
            self.started.said.close()
        if not self.started or not self.running:
            return ""
        one = self.started
        return (
            f"the launch of {one.study} goes on, as process {one.process.pid};"
            f" `kill {one.process.pid}` stops it, and what is done stays"
        )


def proposed(
    study: Study, before: str, results: Location, options: Sequence[str] = ()
) -> Proposal:
    """What a launch of a study from its file would change, where that has another text
    `before`. A page that may not launch is told no more. Raises as `compare`.
    """
    difference, to_run = _changes(study, results)
    return Proposal(
        study.text,
        str(study.path),
        _lines(before, study.text),
        difference,
        to_run,
        shlex.join(["sweep", *_words(study.path, results, options)]),
        "",
        NOBODY,
    )


def stored_spec(stored: StoredStudy) -> Study:
    """The study of a stored spec, as if it stood in a file of the current folder.

    Raises ChoiceError where it names code of its own, and SpecError.
    """
    if isinstance(stored.known, OwnCatalogue):
        raise ChoiceError(
            "its spec names code of its own, which lies beside its file;"
            " sweep show --launch SPEC names that file",
            stored.name,
        )
    return study_with(stored.spec, Path(SPEC), stored.known)


def spec_like(study: Study, text: str) -> Study:
    """The study of another text, as if it stood in the file of this one, with the code
    that this one names. Raises SpecError.
    """
    return study_with(text, study.path, study.known)


def _words(file: Path, results: Location, options: Sequence[str]) -> list[str]:
    """The command that launches a file, without the program."""
    usual = str(results) == "results"
    folder = [] if usual else ["--results", str(results)]
    return ["launch", str(file), *folder, *options]


def _changes(study: Study, results: Location) -> tuple[str, int]:
    """What `sweep diff` says of a study, and how many trials it has to run; of one that
    is not stored, how many it has.
    """
    if not place_of(results / study.name, results).content():
        count = len(Jobs(study, expand(study)))
        return f"new study  {study.name}, {so_many(count, 'trial')} to run", count
    found = compare(StoredStudy(study.name, results), study, results)
    return found.as_text(), found.to_run


def actions(launcher: Launcher | None) -> Mapping[str, Callable[[Any], Any]]:
    """What a page may do, by name: each takes the object that the page sends."""

    def allowed() -> Launcher:
        if launcher is None:
            raise ChoiceError(NOBODY)
        return launcher

    def propose(body: Any) -> dict[str, Any]:
        (text,) = _texts(body, "yaml")
        return allowed().proposed(text)._asdict()

    def launch(body: Any) -> dict[str, Any]:
        text, seen = _texts(body, "yaml", "seen")
        return allowed().launch(text, seen)

    def stop(body: Any) -> dict[str, Any]:
        _texts(body)
        return allowed().stop()

    return {"propose": propose, "launch": launch, "stop": stop}


def state_of(launcher: Launcher | None) -> dict[str, Any]:
    """Whether the page may launch, and what was launched from it."""
    if launcher is None:
        return {"file": "", "started": None}
    return launcher.state()


def _texts(body: Any, *names: str) -> list[str]:
    """The values of an object that has these texts and nothing else. Raises
    ChoiceError: it may come from anyone.
    """
    if not isinstance(body, dict):
        raise ChoiceError("the message must be an object")
    for key in body:
        if key not in names:
            raise ChoiceError(unknown("key of the message", key, names))
    for name in names:
        if not isinstance(body.get(name), str):
            raise ChoiceError(f'the message must have a text "{name}"')
    return [body[name] for name in names]


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _lines(before: str, after: str) -> str:
    """A unified difference without its head, which names files."""
    found = difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="")
    return "\n".join([*found][2:])


def _last(said: BinaryIO) -> str:
    """The end of what a process has written."""
    size = said.seek(0, 2)
    said.seek(max(0, size - LAST_CHARACTERS))
    return said.read().decode("utf-8", "replace").strip()
