"""Thousands of flights advanced at once, one in each thread of a GPU, each with the
bits that it has alone.

    views     parts of large arrays as arrays of their own, for kernels
    layout    the arrays of many flights side by side in a few large ones
    kernel    the kernel that advances and measures the flight of a thread
    batch     flights that are sent to a device, advanced there, and brought back
    host      a device that is this processor, for tests and for what a GPU would do
    ptx       what a kernel is compiled to for a GPU, and whether its bits are the same
    assembly  what that text is assembled to: machine code
    gpu       a device that is a GPU

Only the last three need the extra `gpu`.
"""
