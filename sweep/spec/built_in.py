"""Paths of the built-in studies, the examples, the guide and the citation.

The folders contain specs, tables, published numbers, figures, custom code and pages. In
a wheel the folders are inside the package. In a checkout the folders are next to the
package, and contain more files.
"""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def _place(name: str) -> Path:
    shipped = _PACKAGE / name
    return shipped if shipped.exists() else _PACKAGE.parent / name


EXPERIMENTS = _place("experiments")
"""Built-in studies, one folder per publication."""
EXAMPLES = _place("examples")
"""Examples of custom models, metrics and maps."""
CITATION = _place("CITATION.cff")
"""File with the citation of the program."""
DOCS = _place("docs")
"""Folder of the guide, and of the pages to which the guide links."""
