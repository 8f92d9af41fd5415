"""What makes the bits the same on every machine: choice of engine, `dmath`, the integer clock, random numbers,
tables of state and their flat bytes. Imports nothing of ours.
"""

from miro_exact import engine

engine.install()
