"""Characters of a radio network from files of several formats, decoded.

The input is read once, in pieces, with constant memory. In formats without time (raw, hex) ticks count as if the whole
input were one transmission.
"""
