"""A folder, or a prefix of an object store with the read interface of a folder.

An object store is `s3://bucket/prefix`: Amazon S3, or any store with the interface of
S3, such as MinIO and Ceph. Credentials and region come from the usual environment
variables and files (AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION,
AWS_ENDPOINT_URL, ~/.aws). Options after a question mark take precedence, for example
`s3://bucket/prefix?endpoint_override=127.0.0.1:9000&scheme=http`. This module imports
heavy libraries only when a function needs a library.
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
    """An entry of a listing of objects.

    The size is in bytes. The time of the last write is in ns, by the clock of the
    server.
    """

    st_size: int
    st_mtime_ns: int


class ObjectServer:
    """An object store.

    The store is `known` once it has answered. Only a known store that stops answering
    is asked again.
    """

    def __init__(self, **options: str) -> None:
        self.options = options
        self.known = False

    @cached_property
    def files(self) -> Any:
        """File system of pyarrow.

        The file system repeats failed requests for a second or two, and writes a small
        object by one request.
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
            Path of the call, for the check of the bucket and for errors.
        call : callable
            Takes the file system of pyarrow.

        Raises
        ------
        FileNotFoundError
            If there is no such object.
        UnreachableError
            If the server does not answer.
        StoreError
            If the server rejects the request, or there is no such bucket.
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
                f"s3://{bucket}: there is no such bucket; create the bucket,"
                " or correct the name or the region"
            )

    def trouble(self, path: "ObjectPath", error: OSError) -> StoreError:
        """Return the error that reports a failed request, in a single sentence.

        Parameters
        ----------
        path : ObjectPath
            Path of the request.
        error : OSError
            Error of pyarrow. The message contains the code and words of the server.

        Returns
        -------
        StoreError
            UnreachableError if the server does not answer.
        """
        answer = SAID.search(str(error))
        reason = (
            f"{answer['words'].strip()} [{answer['code']}]"
            if answer
            else " ".join(str(error).split())
        )
        if AWAY.search(str(error)):
            message = (
                f"{path}: the object store does not answer ({reason});"
                " what was stored is intact"
            )
            return UnreachableError(message, self)
        variables = "check AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_REGION"
        return StoreError(
            f"{path}: the object store rejects the request ({reason}); {variables}"
        )


@dataclass(frozen=True)
class ObjectPath:
    """An object, or a prefix, of an object store.

    The class has the methods of pathlib.Path that the reader of a store needs. `key`
    begins with the bucket. `objects` has the objects below the path, by the rest of
    their keys, if a listing exists already: then the server is not asked again. The
    listing suits objects that never change, such as a part.
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
        """Prefix above the object."""
        return ObjectPath(self.server, self.key.rpartition("/")[0])

    @property
    def stem(self) -> str:
        """Last name without the ending."""
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
        """Return the path with a new listing of all objects below it.

        The listing takes a request per 1000 objects.
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
        """Return the objects and prefixes directly below this prefix."""
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
    """Return the location that a user has named.

    Raises StoreError if the location is neither a folder nor in an object store, or if
    the name is not UTF-8.
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
            f"{named}: {unknown('kind of storage', scheme + '://', ['s3://'])}, or a"
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
            f"s3://{place}: allowed: {ALLOWED}; give credentials in environment"
            " variables, not here"
        )
    return ObjectPath(ObjectServer(**options), key)


def in_unicode(path: Path) -> Path:
    """Return the path, if libraries can open its files.

    Raises StoreError if the path is not UTF-8.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise StoreError(
            f"{path}: the name is not UTF-8; choose another name, or rename the folder"
        ) from None
    return path


def local_folder(place: Location, need: str) -> Path:
    """Return the location as a folder.

    Raises StoreError if the location is in an object store. `need` is the message up to
    "a folder on this machine".
    """
    if isinstance(place, Path):
        return place
    raise StoreError(f"{place}: {need} a folder on this machine, not an object store")


def patiently(call: Callable[[], T]) -> T:
    """Return the result of `call`, repeated while the object store does not answer.

    Pauses grow, and last PATIENCE_SECONDS in total. Only a server that has answered
    before gets a second call. After the last call UnreachableError is raised, and the
    server is no longer `known`: so the next write does not wait again.
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
