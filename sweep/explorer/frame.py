"""The page of the explorer as a single text, for a frame of a notebook.

The page may not load or send anything. The page reaches the kernel through the
enclosing frame.
"""

from html import escape

from sweep.web import script, source_of, style

IN_A_NOTEBOOK = {"ask": "kernel", "socket": "kernel"}
"""Modules of the page, with their replacements in a notebook."""


def framed() -> str:
    """Return the page of a frame.

    The frame gives the page an initial address.
    """
    program = script("show", IN_A_NOTEBOOK)
    rules = style("view", "show", "explored")
    policy = (
        f"default-src 'none'; script-src {source_of(program)};"
        f" style-src {source_of(rules)}; img-src blob: data:; form-action 'none'"
    )
    # Without a base a frame uses the base of the notebook for links.
    return f"""<!doctype html>
<html lang="en">
<head>
<base href="about:srcdoc">
<meta charset="utf-8">
<meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy" content="{escape(policy)}">
<title>boidsweep results</title>
<style>{rules}</style>
</head>
<body class="boidsweep-page">
<main class="boidsweep explorer"></main>
<script type="module">{program}</script>
</body>
</html>
"""
