"""The documentation site, which `make docs` builds into build/site, offline.

The pages stand here, and in README.md and the other documents of the repository: each
text has one place. `building/` makes one site of them.
"""
