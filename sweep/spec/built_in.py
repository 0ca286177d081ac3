"""Where the built-in studies, the examples and the guide lie: specs, tables, published
numbers, figures, files of code of one's own, and pages. And how the program is cited.

A wheel has them within the package. In a checkout they lie beside it, and the folders
have the same files and more.
"""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def _place(name: str) -> Path:
    shipped = _PACKAGE / name
    return shipped if shipped.exists() else _PACKAGE.parent / name


EXPERIMENTS = _place("experiments")
"""One folder a publication."""
EXAMPLES = _place("examples")
"""Models, metrics and maps as users write them."""
CITATION = _place("CITATION.cff")
"""How the program is cited."""
GUIDE, DOCS = _place("GUIDE.md"), _place("docs")
"""The guide, and a folder with the pages that it leads to."""
