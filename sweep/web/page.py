"""The page as one text, for places without a server.

The served page loads the modules of `static` one by one. A notebook, and a file that
opens from disk, need one text. It has the same modules, each in a function of its own,
after those that it imports. So a module may import only from its neighbours, by name,
and must write `export` before a declaration. Types are comments in lines of their own;
they are left out.
"""

import re
from pathlib import Path

STATIC = Path(__file__).parent / "static"
IMPORT = re.compile(
    r'^import \{\s+([^}]*?),?\s+\} from "\./([a-z]+)\.js";$',
    re.MULTILINE,
)
EXPORT = re.compile(r"^export (class|const|function) (\w+)", re.MULTILINE)
TYPES = re.compile(r"^ */\*\*((?!\*/).)*\*/\n", re.MULTILINE | re.DOTALL)


def script(name: str) -> str:
    """One ES module: the module of this name, after all modules that it needs."""
    needed: dict[str, str] = {}
    module = _module(name, needed)
    return "\n".join([*needed.values(), module])


def _module(name: str, needed: dict[str, str]) -> str:
    """The text of a module without its imports. The modules that it needs are added to
    `needed`.
    """
    text = TYPES.sub("", _text(f"{name}.js"))
    for _, other in IMPORT.findall(text):
        if other not in needed:
            needed[other] = _enclosed(other, _module(other, needed))
    return IMPORT.sub(r"const { \1 } = \2_js;", text)


def _enclosed(name: str, module: str) -> str:
    """A module in a function of its own, which returns what it exports."""
    exported = ", ".join(member for _, member in EXPORT.findall(module))
    body = EXPORT.sub(r"\1 \2", module)
    return f"const {name}_js = (() => {{\n{body}return {{ {exported} }};\n}})();"


def style(*names: str) -> str:
    """The style sheets of these names, by default that of the view. All their rules
    apply within the class `boidsweep` only.
    """
    return "".join(_text(f"{name}.css") for name in names or ("view",))


def _text(name: str) -> str:
    return (STATIC / name).read_text(encoding="utf-8")
