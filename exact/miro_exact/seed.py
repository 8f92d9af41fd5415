"""The master seed of a run: its range.

What belongs here: nothing else. What does not: what is drawn from it (`rng.py`).
"""

MAX_SEED = (1 << 63) - 1
"""Seeds are 0 to this."""
