"""Settings of all tests."""

import signal

from hypothesis import settings

settings.register_profile("kernels", deadline=None, derandomize=True)
settings.load_profile("kernels")

# A shell starts its background jobs deaf to Ctrl-C, and nohup its jobs to SIGHUP, which tests of interruptions need.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)
