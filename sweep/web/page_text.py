"""A page of HTML that opens from disk.

The page contains script, style and data. The page may not load or send anything.
"""

import base64
import hashlib
import json
import zlib
from collections.abc import Mapping
from html import escape
from typing import Any

from sweep.web.page import script, style

BEST = 9
"""Level of compression with the smallest result."""


def document(
    entry: str,
    sheet: str,
    data: Mapping[str, Any],
    title: str,
    origin: Mapping[str, str],
    *,
    wasm: bool = False,
) -> bytes:
    """Return the page in which a module of `static` shows data.

    Parameters
    ----------
    entry : str
        Name of the module, which reads the JSON of the element "data".
    sheet : str
        Name of the style sheet, which follows the style sheet of the view.
    data : mapping
        Data for the module, without infinite numbers and NaN.
    title : str
        Title of the page.
    origin : mapping of str to str
        Origin of the content, for the metadata of the page.
    wasm : bool, default False
        Whether the page may run WebAssembly, which its data contain.

    Returns
    -------
    bytes
        The HTML in UTF-8.
    """
    program = script(entry)
    rules = style("view", sheet)
    modules = " 'wasm-unsafe-eval'" if wasm else ""
    policy = (
        f"default-src 'none'; script-src {source_of(program)}{modules}; style-src"
        f" {source_of(rules)}; img-src blob: data:"
    )
    # "<" could end the element of the data.
    text = json.dumps(data, allow_nan=False, separators=(",", ":")).replace(
        "<", "\\u003c"
    )
    where = "; ".join(f"{key}: {value}" for key, value in origin.items())
    need = "This page needs JavaScript to play."
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy" content="{escape(policy)}">
<meta name="description" content="{escape(where)}">
<title>{escape(title)}</title>
<style>{rules}</style>
</head>
<body class="boidsweep-page">
<main></main>
<noscript>{escape(title)}: {escape(where)}. {need}</noscript>
<script type="application/json" id="data">{text}</script>
<script type="module">{program}</script>
</body>
</html>
""".encode()


def packed(content: bytes) -> str:
    """Return bytes as a text for a page, compressed.

    The function `unpacked` of `static/packed.js` returns the bytes.
    """
    return base64.b64encode(zlib.compress(content, BEST)).decode()


def source_of(text: str) -> str:
    """Return the name of an inline element with this text in the policy of a page."""
    return (
        f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
    )
