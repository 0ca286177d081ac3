"""Where the built-in studies and the examples lie: specs, tables, published numbers,
figures, files of code of one's own; and how the program is cited.

A wheel has them within the package. In a checkout they are folders beside it, which
have the same files and more.
"""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def _folder(name: str) -> Path:
    shipped = _PACKAGE / name
    return shipped if shipped.is_dir() else _PACKAGE.parent / name


EXPERIMENTS = _folder("experiments")
"""One folder a publication."""
EXAMPLES = _folder("examples")
"""Models, metrics and maps as users write them."""
CITATION = _PACKAGE / "CITATION.cff"
CITATION = CITATION if CITATION.is_file() else _PACKAGE.parent / CITATION.name
"""How the program is cited."""
