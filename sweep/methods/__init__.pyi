from .options import Confidence as Confidence
from .options import Correction as Correction
from .options import Margin as Margin
from .options import Metrics as Metrics
from .options import Over as Over
from .options import OverOption as OverOption
from .options import Together as Together
