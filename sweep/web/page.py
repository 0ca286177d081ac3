"""The page as text: its modules as one, for wherever it must go without a server.

The served page loads the modules of `static` as they are. A notebook and a file that
opens from disk need one text: the same modules, each in a function of its own, after
those that it imports. So a module imports from its neighbours only, by their names and
in one line each, and exports where it declares.
"""

import re
from pathlib import Path

STATIC = Path(__file__).parent / "static"
IMPORT = re.compile(r'^import \{\s([^}]*?),?\s\} from "\./([a-z]+)\.js";$', re.MULTILINE)
EXPORT = re.compile(r"^export (class|const|function) (\w+)", re.MULTILINE)


def script() -> str:
    """One ES module that exports `mount(element, transport, options)` and does nothing
    when it is loaded.
    """
    parts: dict[str, str] = {}
    _add("view", parts)
    return "\n".join(
        [*parts.values(), "const { mount } = view_js;", "export { mount };\n"]
    )


def _add(name: str, parts: dict[str, str]) -> None:
    """Put the module of that name into `parts`, and before it those that it imports."""
    text = _text(f"{name}.js")
    for _, needed in IMPORT.findall(text):
        if needed not in parts:
            _add(needed, parts)
    exported = ", ".join(member for _, member in EXPORT.findall(text))
    body = EXPORT.sub(r"\1 \2", IMPORT.sub(r"const { \1 } = \2_js;", text))
    parts[name] = f"const {name}_js = (() => {{\n{body}return {{ {exported} }};\n}})();"


def style() -> str:
    """The style sheet; all its rules are below the class `boidsweep`."""
    return _text("view.css")


def _text(name: str) -> str:
    return (STATIC / name).read_text(encoding="utf-8")
