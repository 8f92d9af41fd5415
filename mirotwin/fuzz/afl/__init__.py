"""AFL++: the target process it speaks to, and how afl-fuzz is started, watched and ended.

What belongs here: all that knows AFL++. What does not: targets, and what a campaign does with an input. `serve` is the
target process, `run` the campaign, `inputs` what it begins with.
"""

from mirotwin.fuzz.afl.run import AflRun
from mirotwin.fuzz.afl.settings import missing

__all__ = ["AflRun", "missing"]
