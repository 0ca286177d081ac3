"""Studies as parquet files, in a folder or an object store, each part whole or absent.

store            store of a study
writer           collection of results until a part is stored
rows             results as tables
parquet          checksummed files of rows

manifest         list of the files of a part
merging          merging of small parts into large parts
uniting          union of the tables of parts
placed           row numbers of trials

locations        a folder or a bucket
finding          stored studies
places           interface of folders and buckets
folders          a study in a folder
buckets          a study in an object store

lock             exclusive access of a launch to a study
lock_files       files of the claims of launches
held_store       a store under exclusive access

asked_lists      trials that a search has requested
recordings       recorded data of trials, and trials that replace others
link_beginnings  flocks with which the links of chains begin

last_states      states from which longer trials resume
shares           shards of a study, for several machines
provenance       origin of results
repository       state of code and specs in git

origin           origin of stored tables, read and checked
plan_about       record of a study in its plan
stored_code      custom code of stored trials
memory           return of freed memory to the system

user_key         key that marks files as the user's
new_files        creation of a file
durable          files that survive a loss of power
regular          reading of a stored file

bounds           limits on the unpacked size of a table
whole_studies    renaming and removal of a study
processes        identity of this machine and of processes
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
