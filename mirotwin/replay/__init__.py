"""Replay: the script of a recording or stream, and the first difference of two runs with its cause.

    difference = mirotwin.replay.first_difference(one, other)    # two worlds: tick, field, both values

The names of the stub beside this file are loaded on first use, like those of `mirotwin`.
"""

from mirotwin import names_of_stub

__getattr__ = names_of_stub(__name__)
