"""The style of all figures: style sheet, colours, markers.

Each figure states the units, the kind of confidence interval and the number of trials.
The colours are from Okabe and Ito, and can be distinguished with any form of colour
vision.
"""

import re
from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import NamedTuple

from matplotlib.figure import Figure

from sweep.tables import StoredStudy

STYLE = Path(__file__).parent / "house.mplstyle"
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]*")
"""The form of names of figures and claims of a study, which become files and links."""
LINE_STYLES = ("-", "--", "-.", ":", (0, (3, 1, 1, 1, 1, 1)), (0, (6, 2)))
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
PURPLE = "#CC79A7"
ORANGE = "#E69F00"
SKY = "#56B4E9"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, "#000000")
MARKERS = "os^Dvph"
GREY = "0.35"


class Drawing(NamedTuple):
    """A figure in the file figures.py of a study.

    Attributes
    ----------
    draw : callable
        Function that takes the stored studies by the names of the specs, and returns a
        Figure.
    specs : tuple of str
        Names of the required specs.
    text : str
        Caption of one line.
    """

    draw: Callable[[dict[str, StoredStudy]], Figure]
    specs: tuple[str, ...]
    text: str


DRAWING = Lock()
"""Lock for threads that draw, because matplotlib has one style for all threads."""
