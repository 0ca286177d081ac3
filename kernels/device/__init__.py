"""Thousands of trials at once, one in each thread of a GPU.

Results are bitwise identical to those of a trial that runs alone.

    views     parts of large arrays as arrays of their own, for kernels
    layout    the arrays of many trials side by side in a few large ones
    kernel    the kernel that advances and measures the trial of a thread
    batch     trials that are sent to a device, advanced there, and brought back
    host      a device that is this processor, for tests and for debugging
    ptx       PTX of a kernel, and the check that its results are the same
    assembly  machine code of this PTX
    gpu       a device that is a GPU

Only the last three need the extra `gpu`.
"""
