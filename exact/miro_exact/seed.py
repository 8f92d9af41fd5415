"""The master seed of a run: its range."""

MAX_SEED = (1 << 63) - 1
"""Seeds are 0 to this."""
