"""A machine that is put back to one moment and fed with another input, tens of thousands of times a second.

What belongs here: the compiled part of fuzzing. `program.py` makes characters of an input's bytes, `harness.py` sends
them to a board or to the bare processor, and `fast_oracle.py` judges what the robot did. What does not: choosing
inputs, and what a crash is good for (`mirotwin.fuzz`).
"""
