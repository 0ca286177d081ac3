# ruff: noqa: F401, F403
"""Slow twins of the kernels, written for the eye: plain loops, NumPy where it reads
better, no cell grid.

Every public kernel of kernels/rules and kernels/arbitration has a twin of the same name
and the same arguments; every model one that takes a single step; every metric one in
METRICS, from the six rows of one frame to a number.
"""

from tests.naive.aziel_chen2025 import aziel_chen2025
from tests.naive.couzin2002 import couzin2002
from tests.naive.cucker_smale2007 import cucker_smale2007
from tests.naive.dorsogna2006 import dorsogna2006
from tests.naive.flight import (
    Bird,
    OfRobots,
    angle_between,
    birds,
    neighbours,
    turns,
    walk,
)
from tests.naive.metrics import METRICS, flock_sizes
from tests.naive.nanobot import nanobot
from tests.naive.nguyen2024 import nguyen2024
from tests.naive.patel2023 import patel2023
from tests.naive.pixels import blocked, inside_any, visits
from tests.naive.polygons import (
    nearest_of_border,
    polygon_distance,
    walked,
    winding,
)
from tests.naive.rules import *
from tests.naive.rustamani2024 import ORDERS, cells_within, rustamani2024
from tests.naive.strombom2014 import strombom2014
from tests.naive.topology import nearest_of, voronoi_of
from tests.naive.vasarhelyi2018 import vasarhelyi2018
from tests.naive.vicsek1995 import vicsek1995
