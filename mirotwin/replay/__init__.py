"""Replay: the script of a recording or stream, where two runs differ, and what made them.

    difference = mirotwin.replay.first_difference(one, other)    # two worlds: tick, field, both values

The names are those of the stub beside this file, loaded on first use as those of `mirotwin` are.
"""

from mirotwin import names_of_stub

__getattr__ = names_of_stub(__name__)
