"""The options of commands that talk to a robot at a port: where it is, and what may be done to it."""

from __future__ import annotations

from typing import Annotated

from miro_host.wheels import Wheels
from mirotwin.desk.guard import MAX_SPEED_M_S, MotionLimits
from mirotwin.shell.command import Option, Options
from mirotwin.shell.options import FiniteNumber

HEADING = "A robot at a port"
FASTEST_M_S = Wheels().limit_m_s


class DeskOptions(Options, frozen=True, kw_only=True):
    """`port` None: no robot, only its twin."""

    port: Annotated[
        str | None,
        Option(
            metavar="URL",
            heading=HEADING,
            help="Talk to a robot: /dev/ttyUSB0, or any URL that pyserial knows.",
        ),
    ] = None
    allow_motion: Annotated[
        bool,
        Option(
            heading=HEADING,
            needs="port",
            help="Send what moves a robot, too. Without it only what lets it stand is sent.",
        ),
    ] = False
    max_speed: Annotated[
        float,
        Option(
            type=FiniteNumber(0.0, FASTEST_M_S),
            metavar="M_S",
            heading=HEADING,
            needs="port",
            help="Refuse what makes a wheel faster, in m/s.",
        ),
    ] = MAX_SPEED_M_S

    @property
    def limits(self) -> MotionLimits:
        return MotionLimits(self.allow_motion, self.max_speed)
