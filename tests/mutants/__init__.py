"""Mutants: small mistakes, put into the code one at a time, that tests shall notice.

drawing     which mistakes there could be, and a sample of them
equivalent  a table of those that change nothing, as somebody found by reading
copies      copies of the checkout, in which mistakes are made and tests run
nearest     the tests that are nearest to a module
trying      mistakes one after the other, and all that are left together
results     what came out, as it is stored, and as a table

`make mutants` draws, tries and prints the table.
"""
