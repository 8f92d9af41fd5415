"""The LM629's bus limits, checked the slow way: keep every edge, and look back from each.

Times are fractions of a nanosecond. It shares nothing with `miro_robot.lm629.bus_timing` but the names of the limits.
"""

from fractions import Fraction

TICK_NS = Fraction(125, 3)
NEEDED_NS = {
    "/WR pulse": 100
    + 100,  # the second figure is what the AC table of the AT89C52 takes off the nominal time
    "write data set-up": 50,
    "write data hold": 120 + 25,
    "PS set-up": 30,
    "PS hold": 30,
    "recovery between two accesses": 120,
}


def strobe(pins):
    cs, rd, wr, _, _ = pins
    return "" if cs else "write" if not wr else "read" if not rd else ""


class NaiveBusTiming:
    def __init__(self):
        self.history = [(-(10**9), (1, 1, 1, 1, 0xFF))]  # tick; cs, rd, wr, ps, data

    def since(self, tick, change):
        """How long ago `change` last happened, edges on `tick` itself not counted."""
        for (_, before), (at, after) in reversed(list(zip(self.history, self.history[1:], strict=False))):
            moved = strobe(before) != strobe(after)
            happened = {
                "begin": moved and strobe(after) != "",
                "end": moved and strobe(before) != "",
                "written": moved and strobe(before) == "write",
                "ps": before[3] != after[3],
                "data": before[4] != after[4],
            }[change]
            if happened:
                return (tick - at) * TICK_NS
        return Fraction(10**12)

    def pins(self, tick, pins):
        """Every limit that these levels break, in the order of the checks."""
        before = self.history[-1][1]
        moved = strobe(before) != strobe(pins)
        ends, begins = moved and strobe(before) != "", moved and strobe(pins) != ""
        times = []
        if ends and strobe(before) == "write":
            times.append(("/WR pulse", self.since(tick, "begin")))
            times.append(("write data set-up", self.since(tick, "data")))
        if pins[3] != before[3]:
            times.append(("PS hold", Fraction(0) if strobe(before) else self.since(tick, "end")))
        if pins[4] != before[4]:
            now = ends and strobe(before) == "write"
            times.append(("write data hold", Fraction(0) if now else self.since(tick, "written")))
        if begins:
            times.append(("recovery between two accesses", Fraction(0) if ends else self.since(tick, "end")))
            times.append(("PS set-up", Fraction(0) if pins[3] != before[3] else self.since(tick, "ps")))
        self.history.append((tick, pins))
        return [name for name, time in times if time < NEEDED_NS[name]]
