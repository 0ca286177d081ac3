from .frames import open_frames as open_frames
from .recording import SUFFIX as SUFFIX
from .recording import as_model as as_model
from .recording import described as described
