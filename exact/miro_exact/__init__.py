"""The ground floor, what makes the bits the same: which engine runs, `dmath`, the integer clock, random numbers,
tables of state and their flat bytes. Imports nothing of ours.
"""

from miro_exact import engine

engine.install()
