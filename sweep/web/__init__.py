"""The live simulator: a page in the browser, or a widget in a notebook, on the kernels
that sweeps use.

    state          what is on the screen, a spec
    controls       its controls, from the models
    running        simulations that are changed
    session        one live run
    live           a live run as a Show
    replaying      a stored trial as a Show
    track          a stored run, gone through once
    history        metrics by step
    show           what is played to a page
    playing        how it is played
    messages       what the page may say
    protocol       the whole conversation
    outbox         what is on its way to the page
    encoding       frames in a few bytes
    overlays       visits in as few cells as are drawn
    flight         a run with its frames in memory
    filing         what the page wants as a file
    export         pictures and films of a run
    recording      a run as one page of HTML
    page           the page as one text
    replayed_page  a stored trial as a page
    server         the page, to this machine alone
    widget         the page, in a notebook
"""
