"""Where the built-in studies lie: their specs, tables, published numbers and figures.

A wheel has them within the package. In a checkout they are the folder `experiments`
beside it, which has the same files and more.
"""

from pathlib import Path

_SHIPPED = Path(__file__).resolve().parents[1] / "experiments"
EXPERIMENTS = _SHIPPED if _SHIPPED.is_dir() else _SHIPPED.parents[1] / _SHIPPED.name
"""One folder a publication."""
