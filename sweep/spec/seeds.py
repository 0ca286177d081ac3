"""Random streams, addressed by what they are for, so that an extended study changes no
old one.
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
"""What a stream is for. A number is never given to another purpose, or old studies
would change.
"""


def hashed(text: str) -> tuple[int, int]:
    """Two numbers of 32 bits from a hash of `text`, the same in every process."""
    digest = hashlib.sha256(text.encode()).digest()
    return int.from_bytes(digest[:4], "big"), int.from_bytes(digest[4:8], "big")


def address(seed: int, purpose: str, *key: int) -> SeedSequence:
    """The seed sequence of one stream. `purpose` is one of CODES; the numbers in `key`,
    of 32 bits each, say which stream of that purpose it is.
    """
    return SeedSequence(seed, spawn_key=(CODES[purpose], *key))


def point_numbers(point: str) -> tuple[int, int]:
    """The id of a point, 16 hexadecimal digits, as two numbers of 32 bits."""
    return int(point[:8], 16), int(point[8:], 16)
