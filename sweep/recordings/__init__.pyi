from .facts import SUFFIX as SUFFIX
from .facts import as_model as as_model
from .first_rows import Survey as Survey
from .first_rows import survey as survey
from .kept_frames import check_kept as check_kept
from .kept_frames import open_frames as open_frames
from .recording import described as described
