"""Published results: their claims are tested, their figures are drawn, and verdicts are
computed.

    starting            a study of one's own, begun as a copy of a built-in one
    creating            code of one's own, begun as a copy of an example
    claims              published numbers and figures, read from published.yaml
    measures            what a claim measures, and in which trials
    estimates           a measure as an estimate from stored trials
    verdicts            whether an estimate agrees with the published number
    published_code      runs figures.py of a publication
    drawings            draws the figures of a publication that are out of date
    reproduce           runs, draws and judges everything
    scorecard           the rows of the scorecard, one a claim
    scorecard_html      the scorecard as a page
    scorecard_markdown  the scorecard as Markdown
"""
