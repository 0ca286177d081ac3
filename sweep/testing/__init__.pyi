from .beforehand import check_promises as check_promises
from .promises import BROKEN as BROKEN
from .promises import PROMISES as PROMISES
from .promises import assert_keeps as assert_keeps
from .promises import assert_offers as assert_offers
from .promises import check_file as check_file
