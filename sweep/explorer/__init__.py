"""The results explorer: a web interface that shows stored studies.

The explorer only reads, and proposes changes of a spec. Its numbers come from the
tables and figures of a study. So they equal the numbers that `sweep table` prints and
`sweep plot` draws.

    asking             the questions that the page may ask
    watching           stored studies, read again after trials of them were stored
    states             the progress of a study, and its failures
    points             the table of a study, a page at a time
    trials             the trials of a point, the notable ones first
    drawn              figures as marks, each with its command
    mentioned          published numbers that hold at the points of a figure
    compared           two sides, with the points behind each row
    searched           the report of a search, with the points behind each row
    scored             the scorecard, with the points behind each claim
    refining           a spec with more points in a region
    changing           the changes that a launch of such a spec would make
    site               all that the server of the page offers
    frame              the page as one text, for a notebook
    widget             the page, in a notebook

A supplement is another page, one file of HTML for readers:

    supplement         a study as that file
    supplement_figure  the form of its figure: axes and colours
    supplement_front   the texts around the figure
    supplement_trials  the choice of the trials behind a mark
    supplement_runs    a trial that runs again, is compared and recorded
    supplement_room    the number of frames that fit into the page
    publishing         its title, authors, DOI, licence and caption
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
