from .first_rows import Survey as Survey
from .first_rows import survey as survey
from .frames import check_kept as check_kept
from .frames import open_frames as open_frames
from .recording import SUFFIX as SUFFIX
from .recording import as_model as as_model
from .recording import described as described
