"""Studies as parquet files, in a folder or an object store, each part whole or absent.

store       the store of one study
writer      results held, then stored together
rows        results as tables
parquet     checksummed files of rows
manifest    what a part consists of
merging     many small parts as few large ones
uniting     tables of parts as one
placed      where the rows of trials lie
locations   a folder or a bucket
finding     which studies there are
places      what a store asks of either
folders     a study in a folder
buckets     a study in an object store
lock        one launch at a time
lock_files  the files of its claims
custody     a store in one launch's hands
asked_lists what a search has asked for
recordings  what trials record, and which serve for others
last_flocks what links of chains begin with
last_states what trials with more steps go on from
shares      one study on several machines
provenance  where results come from
repository  what git says of code and specs
origin      the same, read from anyone's file
plan_about  what a plan says of its study
stored_code code of the user's own
memory      what is freed, given back to the system
user_key    what is known to be the user's
new_files   how a file comes to be
durable     what outlives a loss of power
regular     how a stored file is read
bounds      how much a table may unpack to
whole_studies a study renamed or removed
processes   who this process is
"""
