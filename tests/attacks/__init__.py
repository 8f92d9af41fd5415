"""What a stranger could do to someone who uses Mirotwin, tried: one file for each surface, one test for each attack.

What belongs here: attacks, and what must come of them. What does not: readers fuzzed by coverage (`tests/fuzz`), and
single mistakes (beside the code that had them).

The tests of a normal run try each attack once, or few times where chance chooses it. `python -m tests.attacks` tries
those of chance `--times` as often.
"""

import os

VARIABLE = "MIROTWIN_ATTACK_TIMES"


def times(quick):
    """How often an attack that chance chooses is tried: `quick` in a normal run."""
    return quick * int(os.environ.get(VARIABLE, "1"))
