"""Key of a user, which marks stored files as files of this user.

Marked files are checkpoints and custom code. A checkpoint has the positions of boids
and counts of collisions. A checksum without a key finds damage. Only a key finds a
forgery, which would enter the results. Custom code runs again without `--trust` only
for the user who launched the code.

The key is a file that only its user can read: by the file mode, or on Windows by the
folder of the user. The coordinator reads the key and passes the key to its workers, so
that workers need no home folder. On a machine with a different key a marked trial
begins again, and marked code needs `--trust`.
"""

import logging
import os
import secrets
import stat
from contextlib import suppress
from functools import cache
from pathlib import Path

from sweep.store.durable import flush
from sweep.store.regular import quietly

LOG = logging.getLogger("sweep")

BYTES = 32
NAME = "boidsweep/checkpoint.key"


@cache
def own_key() -> bytes:
    """Return the user's key, which the first launch makes.

    If no key can be stored, the key is valid only for this process.
    """
    try:
        path = _state_folder() / NAME
        return _read(path) if path.exists() else _made(path)
    except (OSError, RuntimeError) as error:
        effect = (
            "later launches cannot resume from checkpoints of this launch, and custom"
            " code runs again only with --trust"
        )
        LOG.warning(
            "%s; %s; set XDG_STATE_HOME to a folder of your user", error, effect
        )
        return secrets.token_bytes(BYTES)


def _state_folder() -> Path:
    """Return the folder of lasting data of programs (XDG).

    Raises RuntimeError if the user has no home folder.
    """
    folder = Path(os.environ.get("XDG_STATE_HOME", ""))
    return folder if folder.is_absolute() else Path.home() / ".local" / "state"


def _made(path: Path) -> bytes:
    """Return a new key at `path`, or the key that another launch has stored there."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    new = path.with_name(f"{path.name}-{secrets.token_hex(6)}")
    try:
        with os.fdopen(
            os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb"
        ) as file:
            file.write(secrets.token_bytes(BYTES))
            file.flush()
            flush(file.fileno())
        with suppress(FileExistsError):
            path.hardlink_to(new)
    finally:
        new.unlink(missing_ok=True)
    return _read(path)


def _read(path: Path) -> bytes:
    """Return the key in a file.

    Raises OSError if another user can read or write the file.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_BINARY", 0) | quietly())
    try:
        status = os.fstat(descriptor)
        is_key = stat.S_ISREG(status.st_mode) and status.st_size == BYTES
        if not (is_key and _is_private(status)):
            raise OSError(f"{path} is not a key that only you can read: delete it")
        return os.read(descriptor, BYTES)
    finally:
        os.close(descriptor)


def _is_private(status: os.stat_result) -> bool:
    """Return whether only this user can read a file, by owner and mode."""
    if not hasattr(os, "geteuid"):
        return True
    return status.st_uid == os.geteuid() and not status.st_mode & 0o077
