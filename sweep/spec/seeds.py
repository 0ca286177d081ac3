"""Random streams, addressed by what they are for, so that an extended study changes no
old one.
"""

import hashlib

from numpy.random import SeedSequence

CODES = {"design": 0, "start": 1, "world": 2, "noise": 3, "search": 4}
"""What a stream is for. Numbers that have been used are never given to something else.
"""


def words(text: str) -> tuple[int, int]:
    """64 bits of a hash of `text` as two words of 32 bits:
    the same in every process.
    """
    digest = hashlib.sha256(text.encode()).digest()
    return int.from_bytes(digest[:4], "big"), int.from_bytes(digest[4:8], "big")


def address(seed: int, purpose: str, *key: int) -> SeedSequence:
    """The seed sequence of one stream: `purpose` is one of CODES, `key` words of 32
    bits say which one.
    """
    return SeedSequence(seed, spawn_key=(CODES[purpose], *key))


def point_words(point: str) -> tuple[int, int]:
    """The 16 hexadecimal digits of a point as two words of 32 bits."""
    return int(point[:8], 16), int(point[8:], 16)
