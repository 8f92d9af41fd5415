"""One motor winding and its half of the H-bridge: the current through an interval with frozen back-EMF.

The winding's time constant (13 us driven, 22 us through the diodes) is shorter than a PWM period (85 us):
the current ripples fully and stands at zero for part of the period at light load, so no average-voltage model
holds. With the current i positive the bridge puts a voltage `up` on the winding, with i negative `down`:

    bridge               up                      down
    driving forward      VS - drop (transistors) VS + 2 Vf (diodes)
    driving backward     -(VS + 2 Vf) (diodes)   -(VS - drop) (transistors)
    off                  -(VS + 2 Vf) (diodes)   VS + 2 Vf (diodes)

and L di/dt = voltage - emf - R i, R being that of winding, battery and, where transistors conduct, bridge.
As up < down, the current that reaches zero stays there while up <= emf <= down, else it goes on with the
other sign: at most one change of sign in an interval. Source: L298 data sheet (no internal diodes).

The bridge follows its inputs late. A change of the inputs starts a delay: that of turning on if the bridge is off, else
that of turning off. When it is over, the bridge goes to what the inputs ask for. A change back before cancels it: a
gap between two pulses that is shorter than the delay of turning off vanishes.
"""

from __future__ import annotations

from miro_exact import dmath
from miro_sim.plant.params import DriveParams

MAX_TICKS = 2048  # longest interval: one PWM period
TICK_S = 1.0 / 24e6
MOST_CURRENT_A = 1e6  # of a saved state; far more than a motor's


class Winding:
    """Current (A, positive drives forward) in one motor and the state of its bridge."""

    STATE = {
        "current_a": ("d", -1e6, 1e6),
        "drive": ("i", -1, 1),
        "wanted": ("i", -1, 1),
        "wait_ticks": ("i", 0, MAX_TICKS),
    }
    NOT_STATE = (
        "on_ticks",
        "off_ticks",
        "drive_v",
        "diode_v",
        "drive_ohm",
        "diode_ohm",
        "drive_tau",
        "diode_tau",
        "drive_decay",
        "diode_decay",
        "up_v",
        "down_v",
    )

    def __init__(self, params: DriveParams) -> None:
        motor = params.motor
        self.drive_v = params.battery.voltage_v - params.bridge.drop_v
        self.diode_v = params.battery.voltage_v + 2.0 * params.bridge.diode_v
        self.diode_ohm = motor.resistance_ohm + params.battery.resistance_ohm
        self.drive_ohm = self.diode_ohm + params.bridge.drop_ohm
        self.drive_tau = motor.inductance_h / (self.drive_ohm * TICK_S)  # in ticks
        self.diode_tau = motor.inductance_h / (self.diode_ohm * TICK_S)
        self.drive_decay = [dmath.exp(-ticks / self.drive_tau) for ticks in range(MAX_TICKS + 1)]
        self.diode_decay = [dmath.exp(-ticks / self.diode_tau) for ticks in range(MAX_TICKS + 1)]
        self.on_ticks = int(params.bridge.on_delay_s / TICK_S + 0.5)
        self.off_ticks = int(params.bridge.off_delay_s / TICK_S + 0.5)
        self.current_a = 0.0
        self.wanted = 0  # by the inputs
        self.wait_ticks = 0  # until the bridge does it; 0: it does
        self._switch(0)

    def set_bridge(self, enable: int, forward: int) -> None:
        """Inputs of the L298 half: enable pin and direction (1 forward, 0 backward), from now on."""
        wanted = 0
        if enable:
            wanted = 1 if forward else -1
        if wanted == self.wanted:
            return
        self.wanted = wanted
        self.wait_ticks = 0
        if wanted != self.drive:
            self.wait_ticks = self.off_ticks if self.drive != 0 else self.on_ticks
            if self.wait_ticks == 0:
                self._switch(wanted)

    def _switch(self, drive: int) -> None:
        """Makes the transistors drive forward (1) or backward (-1), or turns them off (0)."""
        self.drive = drive
        self.up_v = self.drive_v if self.drive > 0 else -self.diode_v
        self.down_v = -self.drive_v if self.drive < 0 else self.diode_v

    def step(self, ticks: int, emf_v: float) -> float:
        """Advances by 1..2048 ticks with the back-EMF held; returns the charge that passed, in A * ticks."""
        if ticks < 1 or ticks > MAX_TICKS:
            raise ValueError(f"an interval lasts 1..2048 ticks, got {ticks}")
        wait = self.wait_ticks
        if wait == 0:
            return self._flow(ticks, emf_v)
        if wait > ticks:
            self.wait_ticks = wait - ticks
            return self._flow(ticks, emf_v)
        charge = self._flow(wait, emf_v)
        self.wait_ticks = 0
        self._switch(self.wanted)
        if wait < ticks:
            charge = charge + self._flow(ticks - wait, emf_v)
        return charge

    def _flow(self, ticks: int, emf_v: float) -> float:
        """The charge of an interval in which the bridge does not switch."""
        start = self.current_a
        if start == 0.0 and self.up_v <= emf_v <= self.down_v:
            return 0.0  # blocked
        positive = start > 0.0 or (start == 0.0 and emf_v < self.up_v)
        voltage = self.up_v if positive else self.down_v
        if (positive and self.drive > 0) or (not positive and self.drive < 0):
            ohm = self.drive_ohm
            tau = self.drive_tau
            decay = self.drive_decay[ticks]
        else:
            ohm = self.diode_ohm
            tau = self.diode_tau
            decay = self.diode_decay[ticks]
        final = (voltage - emf_v) / ohm
        end = final + (start - final) * decay
        if (end >= 0.0) == positive or end == 0.0:
            self.current_a = end
            return final * ticks + tau * (start - end)
        crossing = tau * dmath.log(1.0 - start / final)
        self.current_a = 0.0
        return final * crossing + tau * start + self._onward(ticks - crossing, emf_v)

    def _onward(self, ticks: float, emf_v: float) -> float:
        """The rest of an interval in which the current came to zero: blocked, or on with the other sign."""
        if ticks <= 0.0:
            return 0.0
        if emf_v < self.up_v:
            voltage = self.up_v
            driven = self.drive > 0
        elif emf_v > self.down_v:
            voltage = self.down_v
            driven = self.drive < 0
        else:
            return 0.0
        ohm = self.drive_ohm if driven else self.diode_ohm
        tau = self.drive_tau if driven else self.diode_tau
        final = (voltage - emf_v) / ohm
        self.current_a = final * (1.0 - dmath.exp(-ticks / tau))
        return final * ticks - tau * self.current_a

    def after_load(self) -> None:
        """Raises ValueError unless the bridge waits exactly while it does not do what its inputs ask for."""
        longest = self.off_ticks if self.drive != 0 else self.on_ticks
        if (self.wait_ticks == 0) != (self.drive == self.wanted) or self.wait_ticks > longest:
            raise ValueError(f"a bridge at {self.drive} waits {self.wait_ticks} ticks for {self.wanted}")
        self._switch(self.drive)

    def __repr__(self) -> str:
        mode = "forward" if self.drive > 0 else "backward" if self.drive < 0 else "off"
        return f"Winding({mode}, {self.current_a!r} A)"
