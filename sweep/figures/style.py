"""The house style: what all figures share. Each figure names its units, its interval
and its number of trials.

The colours are those of Okabe and Ito, which people with any form of colour vision can
tell apart.
"""

import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from sweep.tables.stored_study import StoredStudy

STYLE = Path(__file__).parent / "house.mplstyle"
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
"""What the figures and claims of a study may be called: their names become those of
files and links.
"""
LINE_STYLES = ("-", "--", "-.", ":", (0, (3, 1, 1, 1, 1, 1)), (0, (6, 2)))
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY = (
    "#0072B2",
    "#D55E00",
    "#009E73",
    "#CC79A7",
    "#E69F00",
    "#56B4E9",
)
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, "#000000")
MARKERS = "os^Dvph"
GREY = "0.35"


class Drawing(NamedTuple):
    """A figure of a study's figures.py: `draw` gets the stored studies by the names of
    their specs.

    `specs` are those it needs, and `text` says in one line what it shows.
    """

    draw: Callable[[dict[str, StoredStudy]], Figure]
    specs: tuple[str, ...]
    text: str
