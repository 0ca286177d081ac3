"""The file of a packed study: a zip with a list of checksums of all members.

    README.md               description for readers without boidsweep
    ro-crate-metadata.json  machine-readable description: RO-Crate 1.2

    CITATION.bib            works to cite
    provenance.json         spec, commits, versions, processors

    code/                   custom code, to be read
    tables/                 trials.csv, and columns.csv with a description of columns
    study/                  the stored files of the study, unchanged

    SHA256SUMS              for `sha256sum -c`

No member is compressed, because tables are compressed already. So a file cannot unpack
to more than the size of the file. The file may be untrusted. Before use, a complete
check covers names, kinds of members, sizes, and each checksum.
"""

import hashlib
import io
import re
import stat
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO
from zipfile import ZIP_STORED, BadZipFile, ZipFile, ZipInfo

from sweep.errors import StoreError
from sweep.spec import ASKED, CODE, PART_NAME, PARTS, PLAN, SPEC
from sweep.store import NAME
from sweep.text import shortened

SUMS = "SHA256SUMS"
CRATE = "ro-crate-metadata.json"
STUDY = "study"
"""Folder of the stored files of the study."""
SUM = re.compile(r"([0-9a-f]{64})  (.+)")
MOST_SUMS = 2**26
"""Most bytes of SHA256SUMS."""
MOST_CRATE = 2**20
"""Most bytes of the RO-Crate metadata."""
MOST_MEMBER_NAME = 500
"""Most characters of the name of a member."""
READ_BYTES = 2**20
BEGINNING = (1980, 1, 1, 0, 0, 0)
"""Time of every member, so that a packed study always has identical bytes."""
ENCRYPTED = 0x1
"""Bit of the flags of an encrypted member."""
NONE_OF_OURS = 'is not a file of "sweep pack"'
MADE_BY_UNIX = 3
"""System of every member, so that attributes are a Unix file mode."""
ORDINARY = (stat.S_IFREG | 0o644) << 16
"""Attributes of an ordinary file."""


class Sink(io.RawIOBase):
    """A stream that passes data to a second stream and computes the sha256."""

    def __init__(self, stream: Any) -> None:
        super().__init__()
        self._stream = stream
        self._digest = hashlib.sha256()

    def writable(self) -> bool:
        """Return True: the stream is for writing."""
        return True

    def write(self, data: Any) -> int:
        """Write data, and return the number of bytes."""
        content = memoryview(data).cast("B")
        self._digest.update(content)
        self._stream.write(content)
        return content.nbytes

    @property
    def sha256(self) -> str:
        """The sha256 of all written data, in hexadecimal."""
        return self._digest.hexdigest()


Member = Callable[[Sink], None]
"""Function that writes the content of a member."""


def write_packed(file: BinaryIO, members: Mapping[str, Member]) -> None:
    """Write a packed file: the members in order, followed by the checksums.

    Equal members give identical bytes.
    """
    file.seek(0)
    file.truncate()
    with ZipFile(file, "w", ZIP_STORED) as archive:
        sums = {name: _add(archive, name, write) for name, write in members.items()}
        lines = [f"{digest}  {name}\n" for name, digest in sorted(sums.items())]
        text = "".join(lines).encode()
        _add(archive, SUMS, lambda sink: _write(sink, text))


def _write(sink: Sink, text: bytes) -> None:
    sink.write(text)


def _add(archive: ZipFile, name: str, write: Member) -> str:
    """Write a member, and return its sha256."""
    info = ZipInfo(name, BEGINNING)
    info.create_system = MADE_BY_UNIX
    info.external_attr = ORDINARY
    with archive.open(info, "w", force_zip64=True) as stream:
        sink = Sink(stream)
        write(sink)
        return sink.sha256


class PackedFile:
    """The file of a packed study, checked completely and open for reading.

    Raises StoreError if the file cannot be read, is not a packed study, or is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            # Opening a pipe would wait for the writer.
            if not path.is_file():
                raise OSError(
                    "not an ordinary file" if path.exists() else "no such file"
                )
            self._file = path.open("rb")
        except OSError as error:
            raise StoreError(
                f"{path}: cannot be read ({error.strerror or error})"
            ) from error
        try:
            self._check()
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> "PackedFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def names(self) -> list[str]:
        """Return the members of the study, as paths in the study."""
        begin = f"{STUDY}/"
        inside = (name for name in self.sums if name.startswith(begin))
        return [name.removeprefix(begin) for name in inside]

    def read(self, name: str, most: int) -> bytes:
        """Return the content of a small member.

        Parameters
        ----------
        name : str
            Name of the member.
        most : int
            Most bytes of the member.

        Returns
        -------
        bytes

        Raises
        ------
        StoreError
            If the member is larger or damaged, or has changed since the packing.
        """
        if self._members[name].file_size > most:
            raise self.error(f"{name} is larger than {most:,} bytes")
        content = io.BytesIO()
        self.copy(name, content)
        return content.getvalue()

    def copy(self, name: str, target: Any) -> None:
        """Write the content of a member to a stream.

        Parameters
        ----------
        name : str
            Name of the member.
        target : binary stream

        Raises
        ------
        StoreError
            If the content is damaged, or has changed since the packing.
        """
        sink = Sink(target)
        for content in self._contents(name):
            sink.write(content)
        if name != SUMS and sink.sha256 != self.sums[name]:
            raise self.error(
                f"{name} has changed since the packing: the sha256 differs; get the"
                " file again"
            )

    def _contents(self, name: str) -> Iterator[bytes]:
        """Yield the content of a member, READ_BYTES at a time."""
        # A damaged offset may be before the beginning of the file: an OSError.
        wrong = BadZipFile, EOFError, NotImplementedError, ValueError, OSError
        try:
            with self._archive.open(self._members[name]) as stream:
                while content := stream.read(READ_BYTES):
                    yield content
        except wrong as error:
            raise self.error(f"{name} is damaged ({error})") from error

    def error(self, wrong: str) -> StoreError:
        """Return an error of the file, which begins with the path."""
        return StoreError(f"{self.path}: {wrong}")

    def _check(self) -> None:
        try:
            self._archive = ZipFile(self._file)
        except (BadZipFile, NotImplementedError, ValueError, OSError) as error:
            raise self.error(f"{NONE_OF_OURS} ({error})") from error
        self._members = self._named()
        self.sums = self._listed()
        for name in self.sums:
            self.copy(name, _Nowhere())

    def _named(self) -> dict[str, ZipInfo]:
        """Return the members by name, after a check of names, kinds and sizes."""
        members = dict[str, ZipInfo]()
        for info in self._archive.infolist():
            shown = shortened(ascii(info.filename)[1:-1])
            if info.filename in members:
                raise self.error(f"{shown} is a member twice")
            if why := _strange(info):
                raise self.error(f"{shown} {why}; nothing was written")
            members[info.filename] = info
        for name in (SUMS, CRATE):
            if name not in members:
                raise self.error(f"{NONE_OF_OURS}: {name} is missing")
        size = self._file.seek(0, io.SEEK_END)
        unpacked = sum(info.file_size for info in members.values())
        if unpacked > size:
            raise self.error(f"unpacks to {unpacked:,} bytes, but has only {size:,}")
        return members

    def _listed(self) -> dict[str, str]:
        """Return the sha256 of each member, from SHA256SUMS."""
        lines = self.read(SUMS, MOST_SUMS).decode(errors="replace").splitlines()
        rows = [SUM.fullmatch(line) for line in lines]
        sums = {row[2]: row[1] for row in rows if row}
        if len(sums) < len(lines):
            raise self.error(f"{SUMS} is not a list of checksums")
        different = sums.keys() ^ (self._members.keys() - {SUMS})
        if different:
            shown = shortened(ascii(min(different))[1:-1])
            lost = min(different) in sums
            where = f"is only in {SUMS}" if lost else "has no checksum"
            raise self.error(f"{shown} {where}; get the file again")
        return sums


class _Nowhere:
    def write(self, _content: object) -> None:
        """Discard the content."""


def _strange(info: ZipInfo) -> str:
    """Return why a member is not allowed, in words; "" if it is allowed."""
    name = info.filename
    kind = stat.S_IFMT(info.external_attr >> 16)
    path = PurePosixPath(name)
    plain = path.as_posix() == name and name.isprintable() and "\\" not in name
    if not plain or path.is_absolute() or ".." in path.parts or ":" in name:
        return "is not a plain path within the file"
    if name != info.orig_filename or len(name) > MOST_MEMBER_NAME:
        return "is not an allowed name"
    if kind not in (0, stat.S_IFREG):
        return "is a link or another special file"
    if info.flag_bits & ENCRYPTED:
        return "is encrypted"
    if info.compress_type != ZIP_STORED or info.compress_size != info.file_size:
        return 'is compressed, but "sweep pack" compresses nothing'
    if path.parts[0] == STUDY and not _is_of_a_study(path.parts[1:]):
        return "is not a file of a study"
    return ""


def _is_of_a_study(parts: tuple[str, ...]) -> bool:
    if len(parts) == 1:
        return parts[0] in (PLAN, ASKED, SPEC) or bool(CODE.fullmatch(parts[0]))
    return (
        len(parts) == 3
        and parts[0] == PARTS
        and bool(PART_NAME.fullmatch(parts[1]) and NAME.fullmatch(parts[2]))
    )
