"""The page of the explorer as one text, for a frame of a notebook. It may load nothing
and send nothing: it reaches the kernel through the frame that it is in.
"""

from html import escape

from sweep.web.document import source_of
from sweep.web.page import STATIC, script, style

IN_A_NOTEBOOK = {"ask": "kernel", "socket": "kernel"}
"""Which modules of the page have another one in their place."""


def framed() -> str:
    """The page of a frame. Where it begins, its frame says."""
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
