"""Why mutants are alive: the table `survivors.toml`, one entry for each that no rule kills.

An entry is named by the mutant's id and has `because`, a sentence or two, and `verdict`:

    equivalent   nothing that anybody can do to a robot tells it from the right one
    allowed      it does something else, which the pages that bind a robot leave open
    unreachable  it does what they forbid, but only on a board that no world has (with a broken LM629, for example)
    missing      it does what they forbid, and no rule notices
"""

from pathlib import Path
from typing import Literal

import msgspec

TABLE = Path(__file__).parent / "survivors.toml"


class Survivor(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    verdict: Literal["equivalent", "allowed", "unreachable", "missing"]
    because: str

    @property
    def conforms(self):
        """Whether no right rule can kill it."""
        return self.verdict in ("equivalent", "allowed")


def survivors(path=TABLE):
    """By id. Raises `msgspec.ValidationError` for an entry that is not one."""
    return msgspec.toml.decode(path.read_bytes(), type=dict[str, Survivor])
