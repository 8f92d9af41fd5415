"""The base of reproducible bits on every machine: choice of engine, `dmath`, the integer clock, random numbers, tables
of state and their flat bytes. Imports none of our packages.
"""

from miro_exact import engine

engine.install()
