"""Key of a user, which marks stored files as the user's own.

These are checkpoints, and code that was launched. A checkpoint has the positions of
boids and how often they have collided. A checksum that anyone can compute finds damage;
only a key finds a forgery, which would become a result of ours. In the same way code
runs again without a question only for who has launched it.

The key is a file that only its user can read: by its mode, or on Windows by the folder
of its user. The coordinator reads it and hands it to its workers, so that they need no
home folder. On another machine, with another key, such a trial begins again, and such
code needs a yes.
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
    """Return the user's key, made by the first launch.

    Where none can be kept, it is one for this process.
    """
    try:
        path = _state_folder() / NAME
        return _read(path) if path.exists() else _made(path)
    except (OSError, RuntimeError) as error:
        words = (
            "no later launch goes on from the checkpoints of this one, and code of your"
            " own runs again only with --trust"
        )
        LOG.warning("%s; %s, unless XDG_STATE_HOME is a folder of yours", error, words)
        return secrets.token_bytes(BYTES)


def _state_folder() -> Path:
    """Return where programs keep lasting data (XDG).

    Raises RuntimeError without a home.
    """
    folder = Path(os.environ.get("XDG_STATE_HOME", ""))
    return folder if folder.is_absolute() else Path.home() / ".local" / "state"


def _made(path: Path) -> bytes:
    """Return a new key at `path`, or the one that another launch has put there."""
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

    Raises OSError if others could have written or read it.
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
    """Return whether nobody else can read a file, by its owner and mode."""
    if not hasattr(os, "geteuid"):
        return True
    return status.st_uid == os.geteuid() and not status.st_mode & 0o077
