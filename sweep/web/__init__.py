"""The live simulator: a page in the browser, or a widget in a notebook, on the kernels
that sweeps use.

    state          what is on the screen, a spec
    opened         the spec that was opened, and its text with what was changed
    controls       its controls, from the models
    claimed        published numbers and their settings
    compiling      what is compiled before it is needed
    running        simulations that are changed
    session        one live run
    course         its past, from which any step is run again
    edits          what was edited, to be undone
    live           a live run as a Show
    replaying      a stored trial as a Show
    stored         the stored trials, to go from one to another
    track          a stored run, gone through once
    twin           two runs on one clock
    history        metrics by step
    show           what is played to a page
    playing        how it is played
    messages       what the page may say
    protocol       the whole conversation
    outbox         what is on its way to the page
    encoding       frames in a few bytes
    scene          the world of a trial
    overlays       visits in as few cells as are drawn
    flight         a run with its frames in memory
    filing         what the page wants as a file
    origin         names of files, and what they say of themselves
    export         pictures and films of a run
    recording      a run as one page of HTML
    senses         what tells from places whom a boid sees
    front_matter   its title, caption, citation and licence
    document       a page that opens from disk
    page           the page as one text
    replayed_page  a stored trial as a page
    demo           the demos of the start page
    rooms          the sessions of pages
    server         the page, to this machine alone
    launching      launches that a page asks for, of one spec
    widget         the page, in a notebook
"""
