"""One trial on several cores, in which each thread has a slice of the boids.

team      what each thread knows of the others
barrier   where threads wait for each other
observing what the threads do with a step that is done
slices    a model's `advance` for one of the threads, from its own text
flying    that kernel, run by several threads
"""
