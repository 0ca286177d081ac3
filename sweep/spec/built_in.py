"""Paths of the built-in studies, the examples, the guide and the citation.

The folders have specs, tables, published numbers, figures, custom code and pages. A
wheel has them inside the package. In a checkout they are next to the package, with more
files.
"""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def _place(name: str) -> Path:
    shipped = _PACKAGE / name
    return shipped if shipped.exists() else _PACKAGE.parent / name


EXPERIMENTS = _place("experiments")
"""Built-in studies, one folder per publication."""
EXAMPLES = _place("examples")
"""Custom models, metrics and maps, the way users write them."""
CITATION = _place("CITATION.cff")
"""The citation of the program."""
DOCS = _place("docs")
"""Folder of the guide, and of the pages to which it links."""
