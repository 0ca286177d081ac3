"""Custom models, metrics, maps and initial conditions.

Their code is in files next to a spec, or in modules of packages.

    sources      the text of the files, and of the files that they import
    loading      their modules, made from the text
    installed    modules of packages that a spec names
    places       a table of initial positions of boids
    entries      the entries that a file offers, and their checks
    names        undefined names in its functions
    catalogue    built-in entries with those of the files
    added        the code of a stored study, with further files
    description  the stored description of entries, to be read without their code
    references   the keys of a spec that name code
    reading      from the file of a spec to its study
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
