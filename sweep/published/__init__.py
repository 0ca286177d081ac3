"""Published results: test their claims, draw their figures and compute verdicts.

The modules are:

    starting            a custom study, begun as a copy of a built-in study
    model_studies       a custom study, begun from the description of a model
    recorded_studies    a custom study, begun from a file of tracked individuals
    creating            custom code, begun as a copy of an example

    bibliography        title, authors, year and source of a publication
    publications        a publication: specs, claims and mutants of published.yaml

    claims              text of a claim, and the expectation for our trials
    measures            quantity of a claim, and the measured trials
    estimates           estimate of a measure from stored trials

    definitions         recorded values compared with definitions
    verdicts            verdict on a claim by an estimate
    clocks              stored studies converted to the time steps of another study

    judging             verdicts on a publication by stored trials
    foresight           power of the planned trials, before the run
    statements          claims on one statement, counted once

    published_code      runs figures.py of a publication
    running             runs the missing trials of a publication
    drawings            draws the figures of a publication that are out of date

    margins             claims of different units in one figure
    forest              forest plot of the claims of a publication
    numerics_figure     figure of the effect of numerics on the claims

    variants            a publication with changed studies, such as a mutant
    program_mutants     mistakes of the program, each in a copy of the program
    details             variants with other values of single parameters

    numerics            variants with another time step, order of updates or seed
    trying              runs variants, and compares verdicts
    turned              stored effects of variants on verdicts

    reproducing         runs, draws and judges everything
    scorecard           rows of the scorecard, one per claim
    scorecard_html      the scorecard as HTML
    scorecard_markdown  the scorecard as Markdown

    scorecard_json      the scorecard as JSON
    headline            counts of verdicts in README.md
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
