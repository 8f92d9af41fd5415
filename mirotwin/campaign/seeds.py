"""Seeds as people write them: 0-49, or one alone."""

from __future__ import annotations

from miro_exact.seed import MAX_SEED

MOST_SEEDS = 1000
_LONGEST = 40


def seeds_of(text: str, most: int = MOST_SEEDS) -> range:
    """First and last seed, both included, `most` at most. ValueError with what is wrong."""
    first, _, last = text.partition("-")
    last = last or first
    if not (len(text) <= _LONGEST and first.isdecimal() and last.isdecimal()):
        raise ValueError(f"{text[:_LONGEST]!r} is no range of seeds; write it like 0-49")
    if int(last) > MAX_SEED:
        raise ValueError(f"{text!r}: the largest seed is {MAX_SEED}")
    first_seed, last_seed = int(first), int(last)
    count = last_seed - first_seed + 1
    if not 1 <= count <= most:
        raise ValueError(f"{text!r} has {max(count, 0)} seeds; give 1 to {most}")
    return range(first_seed, last_seed + 1)
