from .analysis import MeanProfile as MeanProfile
from .analysis import ProfileDifference as ProfileDifference
from .analysis import mean_profiles as mean_profiles
from .analysis import profile_difference as profile_difference
from .analysis import profile_units as profile_units
from .analysis import recorded_profiles as recorded_profiles
from .figure import profile_figure as profile_figure
