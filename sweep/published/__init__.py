"""What documents published, run again, drawn and judged.

claims              published numbers and figures
measures            what a claim measures
estimates           a measure in stored trials
verdicts            whether the two agree
published_code      the code of a publication
drawings            its figures, when they change
reproduce           all of it, one after another
scorecard           one row a claim
scorecard_html      the rows as a page
scorecard_markdown  the rows as Markdown
"""
