"""Custom models, metrics, maps and initial conditions.

Custom code is in files next to a spec, or in modules of packages.

    sources      the text of the files and of all imported files
    loading      modules, made from the text
    installed    modules of packages that a spec names

    places       a table of initial positions of boids
    entries      the entries that a file offers, with checks
    names        undefined names in the functions of a file

    catalogue    built-in and custom entries
    added        the code of a stored study, with further files
    description  the stored description of entries, readable without code

    references   the keys of a spec that name code
    reading      from the file of a spec to the study
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
