"""What is brought along for the explorer is what its makers released."""

from hashlib import sha256

import pytest

from sweep.web.page import STATIC

RELEASED = {
    "uplot.js": "19c8d4c6ad88929a79f4ae49d6f7161566dfd0ba3d15cc495e974f787eb78f1f",
    "uplot.css": "df630c6a8d6f8eeaff264b50f73ce5b114f646ffd9a0bb74f049b0a00135fa04",
    "uplot.LICENSE": "8f989229699b4fe2f1a0432d0e9edc338a8a911e250e2d1b01ecd770a5f5b1bd",
}
"""uPlot 1.6.32: dist/uPlot.iife.min.js, dist/uPlot.min.css and LICENSE."""


@pytest.mark.parametrize("name", RELEASED)
def test_it_is_the_release_byte_for_byte(name: str) -> None:
    assert sha256((STATIC / name).read_bytes()).hexdigest() == RELEASED[name]
    assert b"Leon Sorokin" in (STATIC / "uplot.LICENSE").read_bytes()
