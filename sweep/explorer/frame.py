"""The page of the explorer as one text, for a frame of a notebook.

The page may load nothing and send nothing. It reaches the kernel through the frame that
contains it.
"""

from html import escape

from sweep.web import STATIC, script, source_of, style

IN_A_NOTEBOOK = {"ask": "kernel", "socket": "kernel"}
"""Modules of the page, with those that replace them in a notebook."""


def framed() -> str:
    """Return the page of a frame.

    The frame tells the page the address with which it begins.
    """
    program = script("show", IN_A_NOTEBOOK)
    curves = (STATIC / "uplot.js").read_text(encoding="utf-8")
    rules = style("view", "uplot", "show", "explored")
    policy = (
        "default-src 'none'; script-src"
        f" {source_of(curves)} {source_of(program)}; style-src {source_of(rules)};"
        " img-src blob: data:; form-action 'none'"
    )
    # Without a base of its own a frame takes that of the notebook for its links.
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
<script>{curves}</script>
<script type="module">{program}</script>
</body>
</html>
"""
