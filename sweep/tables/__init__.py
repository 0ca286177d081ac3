"""What is stored, as tables: read, chosen, compared, exported and cleaned.

stored_study      a study by name
stored_trials     trials with all their rows
stored_plan       a plan, checked
stored_links      its chains, checked
stored_tables     tables, checked
stored_spec       a row read as a spec
stored_jobs       the job and world of a row
overview          the studies in a folder
choosing          points by their settings
point_means       means, a row a point or several points
means_text        the same in words
reports           answers for a reader and a program
causes            why trials are not done
joined            several studies as one
search_phases     a search with its phases apart
chains            links that cannot run
spec_difference   what a change of a spec does
cleaning          room given back
last_flocks       flocks from which another study starts
flock_changes     who left which flock and joined which
exporting         a table for other programs
netcdf            the same as arrays by trial
arrays            arrays by axis and replicate, for xarray
safe_csv          CSV that starts no formula
json_rows         JSON with all digits
outputs           files for the user, whole or not
"""
