"""Thousands of trials at once, one in each thread of a GPU.

Results are bitwise identical to the results of trials that run alone.

    views     parts of large arrays, as arrays for kernels
    layout    the arrays of many trials, side by side in a few large arrays
    kernel    the kernel that advances and measures the trial of a thread
    batch     trials that are sent to a device, advanced there, and brought back
    image     the memory of a device before the first step of a trial
    host      a device that is this processor, for tests and for debugging
    wasm      WebAssembly of a kernel, and the check that results are identical
    wasmtime_host  a device that runs WebAssembly on this processor
    ptx       PTX of a kernel, and the check that results are identical
    assembly  machine code of PTX
    gpu       a device that is a GPU

The modules for WebAssembly need the extra `wasm`, the last three the extra `gpu`.
"""
