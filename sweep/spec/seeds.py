"""Random streams, addressed by their purpose.

So an extension of a study changes no stream of earlier trials.
"""

import hashlib

from numpy.random import SeedSequence

CODES = {
    "design": 0,
    "start": 1,
    "world": 2,
    "noise": 3,
    "search": 4,
    "made": 5,
    "flown": 6,
}
"""Numbers of the purposes of streams.

A number is never reused for a new purpose, because the streams of old studies would
change.
"""


def hashed(text: str) -> tuple[int, int]:
    """Return two numbers of 32 bits from a hash of a string, equal in all processes."""
    digest = hashlib.sha256(text.encode()).digest()
    return int.from_bytes(digest[:4], "big"), int.from_bytes(digest[4:8], "big")


def address(seed: int, purpose: str, *key: int) -> SeedSequence:
    """Return the seed sequence of one stream.

    `purpose` is a key of CODES. The numbers of `key`, of 32 bits each, distinguish the
    streams of the purpose.
    """
    return SeedSequence(seed, spawn_key=(CODES[purpose], *key))


def point_numbers(point: str) -> tuple[int, int]:
    """Return the id of a point, 16 hexadecimal digits, as two numbers of 32 bits."""
    return int(point[:8], 16), int(point[8:], 16)
