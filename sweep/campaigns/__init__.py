"""Which trials run: all of a plan, as many as an interval needs, or what a search asks
for.

launch    a fixed number of trials, or until intervals are narrow
progress  how far a campaign is, and what shows it
search/   candidates that are asked for, raced and judged
"""
