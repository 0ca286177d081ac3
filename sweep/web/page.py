"""The page as a single text, for use without a server.

The served page loads the modules of `static` separately. A notebook, and a file that
opens from disk, need a single text. The text has every module in a separate function,
after the imported modules. So a module may import only from the folder `static`, by
name or as `import("./name.js")`, and must write `export` before a declaration. Types
are comments in separate lines, which are left out.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

STATIC = Path(__file__).parent / "static"
IMPORT = re.compile(
    r'^import \{\s+([^}]*?),?\s+\} from "\./([a-z]+)\.js";$',
    re.MULTILINE,
)
LATER = re.compile(r'import\("\./([a-z]+)\.js"\)')
"""An import that the served page makes only on demand."""
EXPORT = re.compile(r"^export (class|const|(?:async )?function) (\w+)", re.MULTILINE)
TYPES = re.compile(r"^ */\*\*((?!\*/).)*\*/\n", re.MULTILINE | re.DOTALL)


def script(name: str, instead: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return an ES module: the named module, after all imported modules.

    `instead` has replacements of modules, by the names of the replaced modules.
    """
    needed: dict[str, str] = {}
    module = _module(name, needed, instead)
    return "\n".join([*needed.values(), module])


def _module(name: str, needed: dict[str, str], instead: Mapping[str, str]) -> str:
    """Return the text of a module without the imports.

    The imported modules are added to `needed`.
    """
    text = TYPES.sub("", _text(f"{name}.js"))
    imported = [module for _, module in IMPORT.findall(text)] + LATER.findall(text)
    used = {module: instead.get(module, module) for module in imported}
    for module in used.values():
        if module not in needed:
            needed[module] = _enclosed(module, _module(module, needed, instead))
    text = IMPORT.sub(
        lambda match: f"const {{ {match[1]} }} = {used[match[2]]}_js;", text
    )
    return LATER.sub(lambda match: f"Promise.resolve({used[match[1]]}_js)", text)


def _enclosed(name: str, module: str) -> str:
    """Return a module as a function that returns the exports."""
    exported = ", ".join(member for _, member in EXPORT.findall(module))
    body = EXPORT.sub(r"\1 \2", module)
    return f"const {name}_js = (() => {{\n{body}return {{ {exported} }};\n}})();"


def style(*names: str) -> str:
    """Return the style sheets of these names, by default the style sheet of the view.

    All rules apply within the class `boidsweep` only.
    """
    return "".join(_text(f"{name}.css") for name in names or ("view",))


def _text(name: str) -> str:
    return (STATIC / name).read_text(encoding="utf-8")
