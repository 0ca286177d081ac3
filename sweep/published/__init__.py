"""Published results: their claims are tested, their figures are drawn, and verdicts are
computed.

    starting            a study of one's own, begun as a copy of a built-in one
    model_studies       a study of one's own, begun from what a model says of itself
    creating            code of one's own, begun as a copy of an example
    bibliography        who wrote a document, and when
    publications        a document with its specs, claims and mutants: published.yaml
    claims              what a document says, and what is expected of our trials
    measures            what a claim measures, and in which trials
    estimates           a measure as an estimate from stored trials
    definitions         what is recorded of trials, held to its definitions
    verdicts            what an estimate shows about a claim
    clocks              stored studies told in the steps of another one
    judging             the verdicts on a document by its stored trials
    foresight           what the planned trials could notice, before they run
    statements          claims on the same statement, counted once
    published_code      runs figures.py of a publication
    running             runs what is missing of a publication
    drawings            draws the figures of a publication that are out of date
    margins             claims of different units in one picture
    forest              the claims of a document as one picture
    numerics_figure     what numerics do to them, as one picture
    variants            a publication with changed studies: its mutants, and others
    program_mutants     mistakes of the program, each made in a copy of it
    details             variants with other values of single settings
    numerics            variants with another time step, order of updates or seed
    trying              which verdicts of a document turn with variants
    turned              what variants turned, stored below the results
    reproduce           runs, draws and judges everything
    scorecard           the rows of the scorecard, one a claim
    scorecard_html      the scorecard as a page
    scorecard_markdown  the scorecard as Markdown
    scorecard_json      the scorecard for machines
    headline            what is judged, and what came out, in the readme
"""
