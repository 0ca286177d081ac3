"""Studies as parquet files, in a folder or an object store, each part whole or absent.

store            store of one study
writer           results held, then stored together
rows             results as tables
parquet          checksummed files of rows
manifest         list of the files of a part
merging          many small parts as few large ones
uniting          tables of parts as one
placed           numbers of the rows of trials
locations        a folder or a bucket
finding          studies that are stored
places           calls that a store makes of either
folders          a study in a folder
buckets          a study in an object store
lock             one launch at a time
lock_files       files of its claims
held_store       a store in one launch's hands
asked_lists      trials that a search has asked for
recordings       records of trials, and which serve for others
link_beginnings  beginnings of the links of chains
last_states      states from which trials with more steps resume
shares           one study on several machines
provenance       origin of results
repository       state of code and specs in git
origin           the same, read from anyone's file
plan_about       record of a study in its plan
stored_code      custom code
memory           freed memory, given back to the system
user_key         key that marks files as the user's
new_files        creation of a file
durable          files that outlive a loss of power
regular          reading of a stored file
bounds           limits of what a table may unpack to
whole_studies    a study renamed or removed
processes        identity of this process
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
