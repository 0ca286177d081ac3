"""Published models by name."""

from kernels.model import Model, flaw
from kernels.models import (
    aziel_chen2025,
    couzin2002,
    cucker_smale2007,
    dorsogna2006,
    nanobot,
    nguyen2024,
    patel2023,
    rustamani2024,
    strombom2014,
    vasarhelyi2018,
    vicsek1995,
)
from kernels.registry import Registry

MODELS = Registry(
    "boidsweep.models",
    Model,
    {
        "nguyen2024": nguyen2024.MODEL,
        "aziel_chen2025": aziel_chen2025.MODEL,
        "rustamani2024": rustamani2024.MODEL,
        "patel2023": patel2023.MODEL,
        "nanobot": nanobot.MODEL,
        "vicsek1995": vicsek1995.MODEL,
        "dorsogna2006": dorsogna2006.MODEL,
        "couzin2002": couzin2002.MODEL,
        "cucker_smale2007": cucker_smale2007.MODEL,
        "strombom2014": strombom2014.MODEL,
        "vasarhelyi2018": vasarhelyi2018.MODEL,
    },
    flaw,
)
