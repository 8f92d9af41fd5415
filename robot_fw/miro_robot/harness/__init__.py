"""The compiled part of fuzzing: a machine that is put back to one moment and fed with another input, tens of thousands
of times a second. Choosing inputs, and what a crash is good for, is in `mirotwin.fuzz`.
"""
