"""A stored trial again: to the same bits, as frames, as a film.

replay     a trial run again
verify     a random sample of them
bits       the comparison, bit by bit
flight     every frame of a trial
animation  frames as pictures
video      pictures as GIF or MP4
"""
