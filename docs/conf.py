"""Settings of Sphinx. `docs/building/site.py` makes the sources and calls it."""

from pathlib import Path

import sweep

project = "boidsweep"
version = release = sweep.__version__
copyright = "the authors of boidsweep"  # noqa: A001 (Sphinx calls it so)
language = "en"

extensions = ["myst_parser", "sphinx_design", "docs.building.mathml"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_dmath_allow_space = False
myst_dmath_allow_digits = False
html_math_renderer = "mathml"
myst_heading_anchors = 3
highlight_language = "none"
nitpick_ignore_regex = [("py:.*", ".*")]
"""Types in signatures; links between pages are MyST's, which are all checked."""

html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_title = f"boidsweep {sweep.__version__}"
html_search_scorer = str(Path(__file__).parent / "static" / "scorer.js")
html_copy_source = False
html_show_sphinx = False
