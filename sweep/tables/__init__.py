"""Stored results as tables: read, chosen, compared, exported and cleaned.

stored_study      a study by name
trial_rows        trials with all rows
stored_spec       a row read as a spec
stored_jobs       the job and world of a row

stored_plan       checks of a plan
stored_links      checks of the chains of a plan
stored_tables     checks of tables
causes            causes of trials that are not done
chains            links that cannot run

overview          the studies in a folder
choosing          points by parameters
means             means, one row per point or per group of points
means_text        a table of means in words

reports           answers for a reader and a program
joined            several studies as one
kept_apart        a study with the parts apart that methods separate

spec_difference   effects of a change of a spec
cleaning          removal of unused trials, checkpoints and code

last_flocks       flocks from which another study starts
flock_changes     boids that change from one flock to another

exporting         a table for other programs
netcdf            a table as arrays by trial
arrays            a table as arrays by axis and replicate, for xarray

safe_csv          CSV without formulas
json_text         JSON with all digits
outputs           files for the user, complete or absent
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
