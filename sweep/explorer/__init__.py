"""The results explorer: a web interface that shows stored studies.

The explorer only reads, and proposes changes of a spec. The numbers come from the
tables and figures of a study. So the numbers equal the output of `sweep table` and the
figures of `sweep plot`.

    asking             the questions that the page may ask
    watching           stored studies, read again after new trials were stored
    states             the progress and the failures of a study

    points             the table of a study, a page at a time
    trials             the trials of a point, the notable trials first
    drawn              figures as marks, each with a command

    mentioned          published numbers for the points of a figure
    compared           two sides, with the points behind each row
    searched           the report of a search, with the points behind each row

    scored             the scorecard, with the points behind each claim
    refining           a spec with more points in a region
    changing           the effect of a launch of a refined spec

    site               everything that the server of the page offers
    frame              the page as a single text, for a notebook
    widget             the page, in a notebook

A supplement is a separate page, a file of HTML for readers:

    supplement         a study as a supplement
    supplement_figure  the form of the figure: axes and colours
    supplement_front   the texts around the figure

    supplement_trials  the choice of the trials behind a mark
    supplement_runs    a trial that runs again, is compared and recorded

    supplement_starts  trials that a page computes itself

    supplement_room    the number of frames that fit into the page
    publishing         title, authors, DOI, licence and caption
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
