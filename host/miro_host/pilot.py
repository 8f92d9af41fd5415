"""One robot's chain on the PC, once per camera frame: measurement, law, integrator, wheel commands.

What belongs here: the order of these steps and what happens when a measurement is missing. What does not:
the steps themselves, the clock (times are handed in), several robots (`station`).

The law's velocities v_c, w_c are the commanded ones, the integrator's state before the update (`integrator`
says why). Before the first measurement the command is zero. A lost measurement leaves the integrator alone
and repeats the last command.
"""

from typing import Annotated

import msgspec

from miro_host.integrator import Integrator, Limits
from miro_host.laws.yang_kim import YangKim
from miro_host.posture import Posture
from miro_host.reference import Trajectory
from miro_host.wheels import Wheels

PERIOD_S = 1001.0 / 30000.0  # one NTSC frame, 800 800 ticks


class Command(msgspec.Struct, frozen=True):
    """What goes to the wheels, and how it came about: z_cmd in m/s and rad/s, u and s of the last update.

    `left`, `right` in 1/256 count per LM629 sample.
    """

    left: int
    right: int
    v_m_s: float
    w_rad_s: float
    u1: float
    u2: float
    s1: float
    s2: float


_Speed = Annotated[int, msgspec.Meta(ge=-0x8000, le=0x7FFF)]  # what a frame holds
_SavedCommand = tuple[_Speed, _Speed, float, float, float, float, float, float]

STANDSTILL = Command(0, 0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Pilot:
    """Steers one robot along one reference.

    `reference_lead_s` shifts the instant at which the reference is evaluated against the `t_s` handed to
    `update`; 0 is the paper's loop. The shift is ours, not the paper's: a positive value (up to the time
    the command takes effect) or a negative one (back to the exposure of the image in hand) compensates a
    known delay without touching the law.
    """

    NOT_STATE = ("law", "reference", "reference_lead_s", "wheels")

    def __init__(
        self,
        reference: Trajectory,
        law: YangKim,
        limits: Limits,
        wheels: Wheels | None = None,
        *,
        period_s: float = PERIOD_S,
        reference_lead_s: float = 0.0,
    ) -> None:
        self.reference = reference
        self.law = law
        self.wheels = Wheels() if wheels is None else wheels
        self.reference_lead_s = reference_lead_s
        self.integrator = Integrator(limits, period_s)
        self.command = STANDSTILL

    def __repr__(self) -> str:
        return f"Pilot({self.reference!r}, {self.law!r}, command={self.command!r})"

    def update(self, measured: Posture | None, t_s: float) -> Command:
        """One control period at `t_s` after the reference's start; `measured` may be missing (None)."""
        if measured is None:
            return self.command
        reference = self.reference.at(t_s + self.reference_lead_s)
        z = self.integrator
        control = self.law.control(reference, measured, z.v_m_s, z.w_rad_s)
        z.step(reference.v_dot_m_s2 + control.u1, reference.w_dot_rad_s2 + control.u2)  # equation (15)
        left, right = self.wheels.command(z.v_m_s, z.w_rad_s)
        self.command = Command(
            left, right, z.v_m_s, z.w_rad_s, control.u1, control.u2, control.s1, control.s2
        )
        return self.command

    def snapshot(self) -> dict[str, object]:
        return {"integrator": self.integrator.snapshot(), "command": msgspec.structs.astuple(self.command)}

    def restore(self, state: dict[str, object]) -> None:
        integrator = state["integrator"]
        assert isinstance(integrator, dict)
        self.integrator.restore(integrator)
        left, right, *rest = msgspec.convert(state["command"], _SavedCommand)
        if not all(abs(value) < float("inf") for value in rest):
            raise ValueError("the command holds a value that is not finite")
        self.command = Command(left, right, *rest)
