"""A folder, or a prefix of an object store that is read by the same few calls.

An object store is `s3://bucket/prefix`: that of Amazon, or any other with its
interface, such as MinIO and Ceph. Credentials and region are those of the usual
variables and files (AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION,
AWS_ENDPOINT_URL, ~/.aws). The text after a question mark wins, as in
`s3://bucket/prefix?endpoint_override=127.0.0.1:9000&scheme=http`. This module loads
nothing heavy before it is needed.
"""

import logging
import os
import re
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, TypeVar
from urllib.parse import parse_qsl

from sweep.errors import StoreError, UnreachableError
from sweep.text import unknown

T = TypeVar("T")

LOG = logging.getLogger("sweep")
OPTIONS = ("endpoint_override", "scheme", "region")
ALLOWED = (
    "a folder, or s3://bucket/prefix[?region=...&endpoint_override=...&scheme=...]"
)
URL = re.compile(r"(?P<scheme>[A-Za-z][A-Za-z0-9+.-]+):/+(?P<rest>.*)", re.DOTALL)
AWAY = re.compile(
    "AWS Error (NETWORK_CONNECTION|SERVICE_UNAVAILABLE|INTERNAL_FAILURE|SLOW_DOWN"
    "|THROTTLING|REQUEST_TIMEOUT|REQUEST_EXPIRED"
    r"|UNKNOWN \(HTTP status (5\d\d|429)\))"
)
GONE = re.compile("AWS Error (NO_SUCH_KEY|RESOURCE_NOT_FOUND)")
SAID = re.compile(
    r"AWS Error (?P<code>[A-Z_]+( \(HTTP status \d+\))?).*?operation: (curlCode: \d+,"
    r" )?(?P<words>[^;\n]*)",
    re.DOTALL,
)
ATTEMPTS = 3
PATIENCE_SECONDS = 180.0
FIRST_PAUSE = 0.5
LONGEST_PAUSE = 10.0


class ListedObject(NamedTuple):
    """An object as it was listed.

    Its size is in bytes. The time at which it was written is in ns by the clock of the
    server.
    """

    st_size: int
    st_mtime_ns: int


class ObjectServer:
    """An object store.

    It is `known` once it has answered: only then is it waited for while it is away.
    """

    def __init__(self, **options: str) -> None:
        self.options = options
        self.known = False

    @cached_property
    def files(self) -> Any:
        """File system of pyarrow.

        It repeats what fails for a second or two, and writes small objects by one
        request.
        """
        from pyarrow import fs

        options = self.options
        endpoint = os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get(
            "AWS_ENDPOINT_URL"
        )
        if endpoint and "endpoint_override" not in options:
            scheme, _, place = endpoint.rpartition("://")
            options = {
                "endpoint_override": place,
                "scheme": scheme or "https",
            } | options
        retrying = fs.AwsStandardS3RetryStrategy(max_attempts=ATTEMPTS)
        return fs.S3FileSystem(
            **options,
            retry_strategy=retrying,
            allow_delayed_open=True,
            background_writes=False,
        )

    def ask(self, path: "ObjectPath", call: Callable[[Any], T]) -> T:
        """Return the result of a call on the file system, after a check of the bucket.

        Parameters
        ----------
        path : ObjectPath
            Path of the call, for the check of its bucket and for errors.
        call : callable
            Takes the file system of pyarrow.

        Raises
        ------
        FileNotFoundError
            If there is no such object.
        UnreachableError
            If the server does not answer.
        StoreError
            If the server refuses, or there is no such bucket.
        """
        try:
            if not self.known:
                self._check(path)
                self.known = True
            return call(self.files)
        except FileNotFoundError:
            raise
        except OSError as error:
            # The object was deleted between two requests that pyarrow makes.
            if GONE.search(str(error)):
                raise FileNotFoundError(str(path)) from error
            raise self.trouble(path, error) from error

    def _check(self, path: "ObjectPath") -> None:
        from pyarrow import fs

        bucket = path.key.partition("/")[0]
        if self.files.get_file_info(bucket).type == fs.FileType.NotFound:
            raise StoreError(
                f"s3://{bucket}: there is no such bucket; make it first,"
                " or mend the name or the region"
            )

    def trouble(self, path: "ObjectPath", error: OSError) -> StoreError:
        """Return the error that tells what went wrong, in one sentence.

        Parameters
        ----------
        path : ObjectPath
            Path of the request.
        error : OSError
            Error of pyarrow, whose text has the code and words of the server.

        Returns
        -------
        StoreError
            UnreachableError if the server does not answer.
        """
        answer = SAID.search(str(error))
        words = (
            f"{answer['words'].strip()} [{answer['code']}]"
            if answer
            else " ".join(str(error).split())
        )
        if AWAY.search(str(error)):
            message = (
                f"{path}: the object store does not answer ({words});"
                " what was stored is intact"
            )
            return UnreachableError(message, self)
        variables = "are AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_REGION right?"
        return StoreError(f"{path}: the object store refuses ({words}); {variables}")


@dataclass(frozen=True)
class ObjectPath:
    """An object, or a prefix, of an object store.

    It has those methods of pathlib.Path that the reader of a store needs. `key` begins
    with the bucket. `objects` are the objects below it, by the rest of their keys, if
    they have been listed already: then the server is not asked again. This is for what
    never changes, such as a part.
    """

    server: ObjectServer = field(compare=False, repr=False)
    key: str
    objects: Mapping[str, ListedObject] | None = field(
        default=None, compare=False, repr=False
    )

    def __str__(self) -> str:
        return f"s3://{self.key}"

    def __truediv__(self, name: str) -> "ObjectPath":
        below = None if self.objects is None else _below(self.objects).get(name, {})
        return ObjectPath(self.server, f"{self.key}/{name}", below)

    @property
    def name(self) -> str:
        """Last name in the key."""
        return self.key.rpartition("/")[2]

    @property
    def parent(self) -> "ObjectPath":
        """Prefix above it."""
        return ObjectPath(self.server, self.key.rpartition("/")[0])

    @property
    def stem(self) -> str:
        """Last name without its ending."""
        return Path(self.name).stem

    def stat(self) -> ListedObject:
        """Return size and time.

        Raises FileNotFoundError if there is no such object.
        """
        if self.objects is not None:
            if "" not in self.objects:
                raise FileNotFoundError(str(self))
            return self.objects[""]
        info = self.server.ask(self, lambda files: files.get_file_info(self.key))
        if not info.is_file:
            raise FileNotFoundError(str(self))
        return ListedObject(info.size, info.mtime_ns)

    def exists(self) -> bool:
        """Return whether there is such an object."""
        try:
            self.stat()
        except FileNotFoundError:
            return False
        return True

    def listed(self) -> "ObjectPath":
        """Return the path with all objects below it, as they are now.

        It takes a request per 1000 objects.
        """
        from pyarrow import fs

        selector = fs.FileSelector(self.key, recursive=True, allow_not_found=True)
        infos = self.server.ask(self, lambda files: files.get_file_info(selector))
        start = len(self.key) + 1
        return replace(
            self,
            objects={
                info.path[start:]: ListedObject(max(info.size, 0), info.mtime_ns)
                for info in infos
                if info.is_file
            },
        )

    def iterdir(self) -> Iterator["ObjectPath"]:
        """Return the objects and prefixes directly below this one."""
        here = self if self.objects is not None else self.listed()
        below = _below(here.objects or {})
        return (
            ObjectPath(self.server, f"{self.key}/{name}", objects)
            for name, objects in below.items()
        )

    def glob(self, pattern: str) -> Iterator["ObjectPath"]:
        """Return the entries whose name matches a pattern."""
        return (path for path in self.iterdir() if fnmatchcase(path.name, pattern))

    def open(self, _mode: str = "rb") -> Any:
        """Open the object for reading, whole or in pieces.

        Raises FileNotFoundError if there is no such object.
        """
        return self.server.ask(self, lambda files: files.open_input_file(self.key))

    def head(self, size: int) -> bytes:
        """Return the first `size` bytes.

        Raises FileNotFoundError if there is no such object.
        """

        def read(files: Any) -> bytes:
            content: bytes = files.open_input_stream(self.key).read(size)
            return content

        return self.server.ask(self, read)


def _below(objects: Mapping[str, ListedObject]) -> dict[str, dict[str, ListedObject]]:
    """Return objects by the first name in their keys; "" is the object itself."""
    names = defaultdict[str, dict[str, ListedObject]](dict)
    for key, listed in objects.items():
        name, _, rest = key.partition("/")
        names[name][rest] = listed
    return names


Location = Path | ObjectPath


def location(named: Location | str) -> Location:
    """Return the place that a user has named.

    Raises StoreError if it is neither a folder nor in an object store, and if its name
    is not UTF-8.
    """
    if isinstance(named, ObjectPath):
        return named
    url = URL.fullmatch(str(named))
    if url is None:
        return in_unicode(Path(named))
    scheme = url["scheme"].lower()
    rest, _, query = url["rest"].partition("?")
    if scheme != "s3":
        raise StoreError(
            f"{named}: {unknown('kind of place', scheme + '://', ['s3://'])}, or a"
            " folder"
        )
    options = dict(parse_qsl(query, keep_blank_values=True))
    for name in options:
        if name not in OPTIONS:
            raise StoreError(f"s3://{rest}: {unknown('option', name, OPTIONS)}")
    key = "/".join(filter(None, rest.split("/")))
    if not key or "@" in key.partition("/")[0]:
        place = key.rpartition("@")[2]
        raise StoreError(
            f"s3://{place}: allowed: {ALLOWED}; credentials stand in variables,"
            " never here"
        )
    return ObjectPath(ObjectServer(**options), key)


def in_unicode(path: Path) -> Path:
    """Return the path, if libraries can ask for its files.

    Raises StoreError if its name is not UTF-8.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise StoreError(
            f"{path}: the name is not UTF-8; choose another, or rename the folder"
        ) from None
    return path


def local_folder(place: Location, need: str) -> Path:
    """Return the place as a folder.

    Raises StoreError if it is in an object store, where `need` says what needs a
    folder.
    """
    if isinstance(place, Path):
        return place
    raise StoreError(f"{place}: {need} a folder on this machine, not an object store")


def patiently(call: Callable[[], T]) -> T:
    """Return the result of `call`, tried again while the object store is away.

    Pauses grow, for PATIENCE_SECONDS in all. Only a server that has answered before is
    waited for. In the end UnreachableError is raised, and the server counts as one that
    has never answered: so the next write does not wait again.
    """
    end = time.monotonic() + PATIENCE_SECONDS
    pause = FIRST_PAUSE
    warned = False
    while True:
        try:
            return call()
        except UnreachableError as error:
            if not error.server.known or time.monotonic() + pause > end:
                error.server.known = False
                raise
            if not warned:
                LOG.warning("%s; trying again for %.0f s", error, PATIENCE_SECONDS)
            warned = True
        time.sleep(pause)
        pause = min(2 * pause, LONGEST_PAUSE)
