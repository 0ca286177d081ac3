"""The results explorer: a page that asks about stored studies, and answers as plain
data.

It only reads, and proposes changes of a spec. Numbers come from the tables and figures
of a study, so they are those that `sweep table` prints and `sweep plot` draws.

    asking    the questions that the page may ask
    watching  stored studies, read again when something was stored
    states    how far a study is, and what went wrong
    points    the table of a study, a page at a time
    trials    the trials of a point, what to look at first
    drawn     figures as marks, each with its command
    mentioned published numbers that hold at the points of a figure
    compared  two sides, with the points behind each row
    searched  the report of a search, with the points behind each row
    scored    the scorecard, with the points behind each claim
    refining  a spec with more points in a region
    changing  what such a change would do
    site      what the server of the page has
    frame     the page as one text, for a notebook
    widget    the page, in a notebook

A supplement is another page, one file of HTML for readers:

    supplement         a study as that file
    supplement_figure  the form of its figure: axes and colours
    supplement_front   what stands about the figure
    supplement_trials  which trials stand behind a mark
    supplement_runs    a trial again, compared and recorded
    supplement_room    how many frames the page has room for
    publication        its title, authors, DOI, licence and caption
"""
