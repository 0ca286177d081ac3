"""A stored study to share: as one file, as a citation and as a description.

content      one hash of all results of a study
odd_document ODD description of the model and the study
citing       the works to cite with a study

packed_file  the file of a study, with members and checksums
packing      a study -> one file
unpacking    one file -> a study
stranger     the texts of the file for readers without boidsweep

registration a dated record of a study before its first trial, and its check
certificate  packed studies and publications, run again

laid_out     a study -> spec and code as files, to resume the study
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
