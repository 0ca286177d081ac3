"""A stored trial again: compared bit by bit, as frames, as a film.

replay     runs a stored trial again
verify     runs a random sample of stored trials again
bits       compares a result with what is stored, bit by bit
flight     every frame of a trial
animation  frames as pictures
video      pictures as GIF or MP4
"""
