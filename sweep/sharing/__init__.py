"""A stored study for others: as one file, as a citation, as a description.

content      one hash of all that a study computed
odd          a description of the model and the study
citing       the works that a study rests on
packed_file  a file of a study, its members and their checksums
packing      a study -> one file
unpacking    one file -> a study
laid_out     a study -> its spec and its code as files, to launch on
stranger     the texts of that file for who has no boidsweep
"""
