"""The live simulator: a page in the browser, or a widget in a notebook.

The simulator runs the kernels that sweeps use.

    state          the spec of the run on the screen
    opened         the opened spec, and its text with the changes
    controls       the controls, made from the models

    claimed        published means with parameters
    compiling      compilation before a page waits
    running        simulations whose parameters change

    session        a live run
    course         the past of a live run, from which any step is run again
    edits          undo and redo

    live_show      a live run as a Show
    replaying      a stored trial as a Show
    stored         the stored trials, between which a page moves

    track          a stored trial, run once, with the metrics
    twin           two runs on a common clock
    history        metrics by step

    show           the interface of a run that a page plays
    playing        the player of a Show
    messages       the messages of the page
    protocol       the whole conversation

    outbox         messages and frames on the way to the page
    encoding       frames in a few bytes
    scene          the world of a trial

    overlays       visits in as few cells as are drawn
    flight         a run with all frames in memory
    filing         the files that a page asks for

    origin         names and metadata of files
    export         figures and animations of a run
    recording      a run as a page of HTML

    senses         the facts that give perceived neighbours from positions
    front_matter   title, caption, citation and licence of a recording

    page_text      a page that opens from disk
    page           the page as a single text
    replayed_page  a stored trial as a page

    demo           the demos of the start page
    rooms          the sessions of pages
    server         the page, to this machine alone

    launching      launches of a spec that a page asks for
    widget         the page, in a notebook
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
