"""Which mutants of the firmware are looked at: all that there could be in a stable order, and a draw with a seed.

The draw is spread over files and operators: of each operator in each file one comes first, then the others in
proportion to how many there are. So a small file is seen, and a table of constants does not fill the list.
"""

from collections import defaultdict
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

from miro_exact.rng import Stream
from tests.mutants.operators import OPERATORS, Change, changes

SOURCE = Path(__file__).parents[2] / "robot_fw" / "firmware"
SEED = 1997
COUNT = 180


class Mutant(NamedTuple):
    """One change in one file of the firmware. `line` and `column` count from 1."""

    file: str
    line: int
    column: int
    change: Change

    @property
    def id(self):
        return f"{self.file}:{self.line}:{self.column}:{self.change.operator}:{self.change.form}"

    @property
    def diff(self):
        """The change on one line; places of deleted text are empty."""
        old, new = (" ".join(text.split()) for text in (self.change.old, self.change.new))
        return f"{old} -> {new}"


def source_files(folder=SOURCE):
    """The C files of the firmware, in the order of their names."""
    return {path.name: path.read_text("utf-8") for path in sorted(folder.glob("*.[ch]"))}


def mutants_of(sources):
    """All mutants, by file and place."""
    found = []
    for file, text in sources.items():
        for change in changes(text):
            line_begin = text.rfind("\n", 0, change.start) + 1
            line = text.count("\n", 0, change.start) + 1
            found.append(Mutant(file, line, change.start - line_begin + 1, change))
    return found


def drawn(mutants, count=COUNT, seed=SEED):
    """`count` of them, or all; the first ones of a longer draw are those of a shorter one."""
    stream = Stream(seed, "mutants of the firmware")
    groups = defaultdict(list)
    for index, mutant in enumerate(mutants):
        groups[mutant.file, OPERATORS.index(mutant.change.operator)].append((stream.u64(index), index))
    order = []
    for group, members in sorted(groups.items()):
        for rank, (_, index) in enumerate(sorted(members)):
            order.append((Fraction(rank, len(members)), group, index))
    return [mutants[index] for _, _, index in sorted(order)[:count]]
