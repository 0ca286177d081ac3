"""The live simulator: a page in the browser, or a widget in a notebook.

It runs the kernels that sweeps use.

    state          the spec of what is on the screen
    opened         the opened spec, and its text with the changes
    controls       the controls, made from the models
    claimed        published means with the parameters that they hold for
    compiling      compilation before a page waits for it
    running        simulations whose parameters change
    session        one live run
    course         its past, from which any step is run again
    edits          undo and redo
    live_show      a live run as a Show
    replaying      a stored trial as a Show
    stored         the stored trials, to go from one to another
    track          a stored trial, run once, with its metrics
    twin           two runs on one clock
    history        metrics by step
    show           the interface of what is played to a page
    playing        the player of a Show
    messages       the messages of the page
    protocol       the whole conversation
    outbox         messages and frames on their way to the page
    encoding       frames in a few bytes
    scene          the world of a trial
    overlays       visits in as few cells as are drawn
    flight         a run with its frames in memory
    filing         the files that a page asks for
    origin         names and metadata of files
    export         figures and animations of a run
    recording      a run as one page of HTML
    senses         the facts that give perceived neighbours from positions
    front_matter   title, caption, citation and licence of a recording
    page_text      a page that opens from disk
    page           the page as one text
    replayed_page  a stored trial as a page
    demo           the demos of the start page
    rooms          the sessions of pages
    server         the page, to this machine alone
    launching      launches that a page asks for, of one spec
    widget         the page, in a notebook
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
