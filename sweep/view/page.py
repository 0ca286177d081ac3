"""The page as text: its modules as one, for wherever it must go without a server.

The served page loads the modules of `static` as they are. A notebook and a file that opens from disk need one text:
the same modules, one after the other, without what binds them together. So a module imports from its neighbours only,
in one line each, and no two have a top-level name in common.
"""

import re
from pathlib import Path

STATIC = Path(__file__).parent / "static"
MODULES = (
    "dom.js",
    "frames.js",
    "stage.js",
    "pointer.js",
    "plots.js",
    "fields.js",
    "lists.js",
    "dialogs.js",
    "view.js",
)
"""Each after those that it needs. page.js, which speaks to the server, is not among them."""
JOINED = re.compile(r'^import \{[^}]*\} from "\./[a-z]+\.js";\n', re.MULTILINE)
EXPORTED = re.compile(r"^export (?=class|const|function)", re.MULTILINE)


def script() -> str:
    """One ES module that exports `mount(element, transport, options)` and does nothing when it is loaded."""
    parts = (EXPORTED.sub("", JOINED.sub("", _text(name))) for name in MODULES)
    return "\n".join([*parts, "export { mount };\n"])


def style() -> str:
    """The style sheet; all its rules are below the class `boidsweep`."""
    return _text("view.css")


def _text(name: str) -> str:
    return (STATIC / name).read_text(encoding="utf-8")
