"""Characters of a radio network from files of several formats, decoded.

Everything is read once, in pieces: what is kept does not grow with the file. In formats without time (raw, hex) ticks
count on as if the whole input were one transmission.
"""
