"""Trials in worker processes, here or on a cluster: no trial is lost, none is stored
twice.

batch              trials run and stored, failed ones tried again
runner             the loop that hands jobs out and takes results back
chunks             jobs dealt out in portions of about equal work
executors          processes on this machine
worker             what a worker does with a chunk
watch              limits, kept from outside
failures           how many a study may have
fingerprint        what is equal everywhere
surroundings       a user's folder is no code
checkpoint         long trials go on
checkpoint_file    its two files
checkpoint_folder  which of them go
checkpoint_key     whose they are
cluster            workers by dask
connection         to its scheduler, within a time
tasks              our tasks there
remote             what a worker there does
warden             limits of a worker there
"""
