"""Launches of a spec that a page asks for, in the file that the user has named.

A page proposes a text for this file, and gets the changes that a launch would make.
If the user confirms the changes, the text is written, and `sweep launch` of the file
runs as a separate process. The process has no terminal, and continues after the end of
the page and of this server.
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
from sweep.design import Jobs, expand
from sweep.errors import ChoiceError
from sweep.own_code import OwnCatalogue, load_spec, study_with
from sweep.spec import SPEC, Study
from sweep.store import Location, Lock, place_of
from sweep.tables import StoredStudy, compare, unfinished
from sweep.text import so_many, unknown

NOBODY = "This page only reads; start the server with --launch SPEC to launch."
LAST_CHARACTERS = 2000
"""Largest number of characters of the output of a launch that a page gets."""
PROCESS = (sys.executable, "-P", "-c", "from sweep.cli import main; main()")


class Proposal(NamedTuple):
    """The changes that a launch of a text would make.

    Attributes
    ----------
    text : str
        Text of the spec.
    file : str
        File for the text; "" for no file.
    lines : str
        Changes of the text in the file, as a unified difference.
    difference : str
        Output of `sweep diff`; for a new study, the number of trials.
    to_run : int
        Trials that are not stored yet.
    command : str
        Command that launches the file after the text is written.
    digest : str
        SHA-256 of the text in the file that `lines` compares with; "" for no file.
    why_not : str
        Reason why the page cannot launch the text; "" where the page can.
    """

    text: str
    file: str
    lines: str
    difference: str
    to_run: int
    command: str
    digest: str
    why_not: str

    def as_reply(self) -> dict[str, Any]:
        """Return the object for a page, which knows the digest as ``seen``."""
        reply = self._asdict()
        reply["seen"] = reply.pop("digest")
        return reply


class StartedLaunch(NamedTuple):
    """A launch that was started here, with the file of its stderr."""

    study: str
    process: "subprocess.Popen[bytes]"
    stderr: BinaryIO


class Launcher:
    """Launches the spec in a file into a results folder. Any thread may call a method.

    Parameters
    ----------
    file : Path
        The file, which need not exist yet.
    results : Location
        Folder of stored studies.
    options : sequence of str, optional
        Further options of the command.
    catalogue : Catalogue, optional
        Models, metrics and maps by name where the file does not exist yet. A text can
        name only code that is known here.
    read : callable, optional
        Reads the spec in an existing file.

    Raises
    ------
    SpecError
        If the spec in the file is not valid.
    ChoiceError
        If the file is a link, or the folder of the file does not exist.
    """

    def __init__(
        self,
        file: Path,
        results: Location,
        options: Sequence[str] = (),
        *,
        catalogue: Catalogue = BUILT_IN,
        read: Callable[[Path], Study] = load_spec,
    ) -> None:
        self.file = file
        self.results = results
        self._options = tuple(options)
        self._catalogue = catalogue
        self._read = read
        self._lock = threading.Lock()
        self.started: StartedLaunch | None = None
        if file.is_symlink():
            raise ChoiceError(f"--launch {file}: is a link; name the target file")
        if not file.parent.is_dir():
            raise ChoiceError(f"--launch {file}: there is no folder {file.parent}")
        study = self.now()
        self.study = study.name if study else ""

    def now(self) -> Study | None:
        """Return the study that is in the file now; None for no file.

        The exceptions of `load_spec` are raised.
        """
        return self._read(self.file) if self.file.exists() else None

    def proposed(self, text: str) -> Proposal:
        """Return the changes that a launch of this text would make.

        The exceptions of `compare` are raised.
        """
        return self._proposed(text)[0]

    def _proposed(self, text: str) -> tuple[Proposal, Study]:
        current = self.now()
        study = study_with(
            text, self.file, current.catalogue if current else self._catalogue
        )
        proposal = proposed(
            study, current.text if current else "", self.results, self._options
        )
        digest = _sha256(current.text) if current else ""
        return proposal._replace(digest=digest, why_not=self._why_not(study)), study

    def _why_not(self, study: Study) -> str:
        """Return why a study cannot be launched now; "" where a launch is possible."""
        owners = Lock(place_of(self.results / study.name, self.results)).owners()
        if self.running:
            return "A launch that was started here is still running."
        if owners:
            return f"The study is being launched by {', '.join(owners)}."
        return ""

    @property
    def running(self) -> bool:
        """True while a launch that was started here runs."""
        return self.started is not None and self.started.process.poll() is None

    def launch(self, text: str, digest: str) -> dict[str, Any]:
        """Write a proposed text into the file, launch the file, and return the state.

        Parameters
        ----------
        text : str
            Text of the spec.
        digest : str
            Digest of the proposal that the user has confirmed.

        Raises
        ------
        ChoiceError
            If the file has changed since the proposal, or the study is being launched.
        OutputError
            If the file cannot be written.
        UserError
            If `proposed` raises an exception.
        """
        with self._lock:
            proposal, study = self._proposed(text)
            if proposal.digest != digest:
                raise ChoiceError(
                    f"{self.file}: has changed since this page has read the file;"
                    " review the changes again"
                )
            if proposal.why_not:
                raise ChoiceError(proposal.why_not, study.name)
            with unfinished(self.file) as file:
                file.write(text.encode())
            if self.started:
                self.started.stderr.close()
            self.started = self._start(study)
        return self.state()

    def _start(self, study: Study) -> StartedLaunch:
        own = isinstance(study.catalogue, OwnCatalogue)
        arguments = [*_words(self.file, self.results, self._options), "--quiet"]
        arguments += [] if own else ["--no-code"]
        stderr = tempfile.TemporaryFile()  # noqa: SIM115 - as long as its launch
        process = subprocess.Popen(
            [*PROCESS, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=stderr,
            start_new_session=True,
        )
        return StartedLaunch(study.name, process, stderr)

    def stop(self) -> dict[str, Any]:
        """Stop a launch that was started here, and return the state.

        Finished trials stay stored.
        """
        with self._lock:
            if self.started and self.running:
                self.started.process.terminate()
        return self.state()

    def state(self) -> dict[str, Any]:
        """Return the file, and the state of the launch that was started here.

        The state of a launch has the study, the process, the exit code (None for a
        running process) and the end of stderr.
        """
        started = self.started
        if started is None:
            return {"file": str(self.file), "started": None}
        code = started.process.poll()
        launch = {
            "study": started.study,
            "process": started.process.pid,
            "code": code,
            "said": _last(started.stderr) if code and not started.stderr.closed else "",
        }
        return {"file": str(self.file), "started": launch}

    def leave(self) -> str:
        """Release the launch that was started here, and return a text for the user.

        The text tells how to stop a launch that still runs; "" if no launch runs.
        """
        if self.started:
            self.started.stderr.close()
        if not self.started or not self.running:
            return ""
        process = self.started.process.pid
        return (
            f"the launch of {self.started.study} continues as process {process};"
            f" `kill {process}` stops the launch, and finished trials stay stored"
        )


def proposed(
    study: Study, before: str, results: Location, options: Sequence[str] = ()
) -> Proposal:
    """Return the changes that a launch of a study from a file would make.

    The proposal is for a page that may not launch.

    Parameters
    ----------
    study : Study
        Study of the proposed text.
    before : str
        Present text of the file.
    results : Location
        Folder of stored studies.
    options : sequence of str, optional
        Further options of the command.

    Raises
    ------
    UserError
        If `compare` raises an exception.
    """
    difference, to_run = _changes(study, results)
    return Proposal(
        text=study.text,
        file=str(study.path),
        lines=_lines(before, study.text),
        difference=difference,
        to_run=to_run,
        command=shlex.join(["sweep", *_words(study.path, results, options)]),
        digest="",
        why_not=NOBODY,
    )


def stored_spec(stored: StoredStudy) -> Study:
    """Return the study of a stored spec, as of a file in the current folder.

    Raises ChoiceError where the spec names custom code, and SpecError.
    """
    if isinstance(stored.known, OwnCatalogue):
        raise ChoiceError(
            "the stored spec names custom code, which is next to the file of the spec;"
            " name this file with sweep show --launch SPEC",
            stored.name,
        )
    return study_with(stored.spec, Path(SPEC), stored.known)


def spec_like(study: Study, text: str) -> Study:
    """Return the study of another text, as if the file of this study had the text.

    The text may name the code that this study names. Raises SpecError.
    """
    return study_with(text, study.path, study.catalogue)


def _words(file: Path, results: Location, options: Sequence[str]) -> list[str]:
    """Return the command that launches a file, without the program."""
    usual = str(results) == "results"
    folder = [] if usual else ["--results", str(results)]
    return ["launch", str(file), *folder, *options]


def _changes(study: Study, results: Location) -> tuple[str, int]:
    """Return the output of `sweep diff` for a study, and the number of trials to run.

    For a study that is not stored, the number of trials to run is the number of trials.
    """
    if study.strategy_section and not study.has_design:
        section, _ = study.strategy_section
        message = (
            "a page launches only trials that are known in advance; run"
            f' "sweep {section.command}" for "{section.key.name}"'
        )
        raise study.document.error(section.place, message)
    if not place_of(results / study.name, results).content():
        count = len(Jobs(study, expand(study)))
        return f"new study  {study.name}, {so_many(count, 'trial')} to run", count
    comparison = compare(StoredStudy(study.name, results), study, results)
    return comparison.as_text(), comparison.to_run


def actions(launcher: Launcher | None) -> Mapping[str, Callable[[Any], Any]]:
    """Return the actions of a page by name; each takes the object of the page."""

    def allowed() -> Launcher:
        if launcher is None:
            raise ChoiceError(NOBODY)
        return launcher

    def propose(body: Any) -> dict[str, Any]:
        (text,) = _texts(body, "yaml")
        return allowed().proposed(text).as_reply()

    def launch(body: Any) -> dict[str, Any]:
        text, digest = _texts(body, "yaml", "seen")
        return allowed().launch(text, digest)

    def stop(body: Any) -> dict[str, Any]:
        _texts(body)
        return allowed().stop()

    return {"propose": propose, "launch": launch, "stop": stop}


def state_of(launcher: Launcher | None) -> dict[str, Any]:
    """Return the state of a launcher; without a launcher a page may not launch."""
    if launcher is None:
        return {"file": "", "started": None}
    return launcher.state()


def _texts(body: Any, *names: str) -> list[str]:
    """Return the values of an object with these strings and no further keys.

    Raises ChoiceError for any other object, because anyone may send objects.
    """
    if not isinstance(body, dict):
        raise ChoiceError("the message must be an object")
    for key in body:
        if key not in names:
            raise ChoiceError(unknown("key of the message", key, names))
    for name in names:
        if not isinstance(body.get(name), str):
            raise ChoiceError(f'the message must have a string "{name}"')
    return [body[name] for name in names]


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _lines(before: str, after: str) -> str:
    """Return a unified difference without the head, which names files."""
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), lineterm="")
    return "\n".join([*lines][2:])


def _last(stderr: BinaryIO) -> str:
    """Return the end of the output of a process."""
    size = stderr.seek(0, 2)
    stderr.seek(max(0, size - LAST_CHARACTERS))
    return stderr.read().decode("utf-8", "replace").strip()
