"""The rules of the house, which sources and documents keep: `python -m tests.house`
prints every place that breaks one. `make check` runs it.

    rules        all rules, and what they find
    sources      a checkout, each of whose files is parsed once, and what a finding is
    imports      who imports whom
    kernels      what kernels may import and call
    names        who knows entries by name
    packages     what packages, modules and classes say of themselves
    figures      how figures are told of distributions
    scripts      scripts of the page
    evaluation   who runs text or data as code
    extras       which extras there are
    systems      who asks for what one operating system lacks
    writing      who writes files, and how
    plain        names, assignments, arguments and docstrings
    documents    links, names of files, decisions, words, the page on trust

A rule is a function that yields findings. `test_rules.py` breaks each of them.
"""
