"""A stored trial again: compared bit for bit, as frames, as an animation.

replay     runs a stored trial again
verify     runs a random sample of stored trials again
bits       compares a result with the stored values, bit for bit
flight     every frame of a trial
animation  frames as figures
video      figures as GIF or MP4
"""
