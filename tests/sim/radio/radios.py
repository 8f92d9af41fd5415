"""Radios for tests: without errors unless they are asked for, and with times in ticks."""

from miro_exact.clock import TICKS_PER_SECOND
from miro_sim.radio.params import Dropouts, Radio

ALWAYS = Dropouts(every_s=0.000105, length_s=1e6)
"""No carrier from the first bits on."""


def clean(**keys):
    """A radio with these keys; `latency_ticks` is `latency_s` in ticks, and so on."""
    found = {} if "eb_n0_db" in keys else {"bit_error_rate": 0.0}
    for key, value in keys.items():
        name = key.removesuffix("_ticks")
        found.update({key: value} if name == key else {f"{name}_s": value / TICKS_PER_SECOND})
    return Radio(**found)
