"""References of other distributions: what is asked of each place that they give."""

import math
from collections.abc import Iterator

import msgspec

from miro_host.plugins import PluginError
from miro_host.posture import Posture
from miro_host.raised import at_place, defined_at, described, raised_at
from miro_host.references.interface import Reference, Trajectory


class CheckedReference:
    """A trajectory of another distribution: what it gives is finite, and what it raises names it.

    A trajectory has no memory: it is a function of time.
    """

    def __init__(self, trajectory: Trajectory, name: str) -> None:
        self.trajectory = trajectory
        self.name = name

    def __repr__(self) -> str:
        return f"CheckedReference({self.trajectory!r})"

    def at(self, t_s: float) -> Reference:
        """The reference at `t_s`. Raises PluginError."""
        try:
            found = self.trajectory.at(t_s)
            if not isinstance(found, Reference):
                raise ValueError(f"`at` returned {found!r:.40}, which is no Reference")
            if not isinstance(found.posture, Posture):
                raise ValueError(f"its posture is {found.posture!r:.60}, which is no Posture")
            for value in _numbers(found):
                if type(value) is not float or not math.isfinite(value):
                    raise ValueError(f"it returned {found!r}; all must be finite floats")
        except (Exception, SystemExit) as error:
            reason = str(error) if type(error) is ValueError else described(error)
            place = raised_at(error) or defined_at(getattr(self.trajectory, "at", None))
            what = f"reference {self.name!r} failed at {t_s:.6f} s: {at_place(reason, place)}"
            raise PluginError(what, "mend the reference or its parameters") from error
        return found


def _numbers(found: Reference) -> Iterator[object]:
    posture, *rates = msgspec.structs.astuple(found)
    yield from msgspec.structs.astuple(posture)
    yield from rates
