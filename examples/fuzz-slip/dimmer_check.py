"""What the dimmer must keep to, whatever it is sent: checks for `mirotwin fuzz --expect`."""

from slip_protocol import Damage, Slip

from mirotwin.verify.bare.exchange import Exchange

BRIGHT = 100
P1 = 0x90


def lamps_as_told(run: Exchange) -> str | None:
    """Levels are 0..100, a lamp is on P1 if its level is not 0, and each answer is a good frame."""
    levels = run.memory["level"]
    for lamp, level in enumerate(levels):
        if level > BRIGHT:
            return f"lamp {lamp} has level {level}, of 0..{BRIGHT}"
        if bool(run.memory.sfr(P1) >> lamp & 1) != (level > 0):
            return f"lamp {lamp} has level {level} and is {'on' if level == 0 else 'off'}"
    said = run.sent_since_reset
    for one in Slip().decode(said):
        if isinstance(one, Damage):
            return f"the answer {said[one.start : one.end].hex(' ')} is no frame: {one.reason}"
    return None
