"""Recordings: tracked individuals in files, as the trials of a study.

row_errors   mistakes in rows, each with file and row
files        formats of files, which are read piece by piece
rows         the files and columns of a section, and values of columns
tracks       the rows of each individual in each event, on disk
frames       positions and velocities of all individuals at regular times

facts        a recording as a text, and the model that plays the recording
kept_frames  frames that are kept on this machine
first_rows   the columns of a file, and how far apart its times are
recording    from the section of a spec to facts and frames
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
