"""A stored study for other people: as one file, a citation and a description.

content      one hash of all results of a study
odd_document ODD description of the model and the study
citing       the works to cite with a study
packed_file  the file of a study, its members and their checksums
packing      a study -> one file
unpacking    one file -> a study
laid_out     a study -> its spec and its code as files, to resume it
stranger     the texts of that file for readers without boidsweep
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
