"""Models, metrics, maps and starts of the user's own, in files beside a spec or in
modules of packages.

sources      the text of the files, and of what they import
loading      their modules, made from the text
installed    modules of packages that a spec names
places       a table of where boids start
entries      what a file offers, and what it must be
names        names in its functions that stand for nothing
catalogue    names with those of the files
added        the code of a stored study, with further files
description  what is stored of entries, to be read without their code
references   where a spec names code
reading      from the file of a spec to its study
"""
