"""Kernels against slow twins, laws and hand-made flocks."""
