"""The GTKWave save file that goes with a waveform: groups, and bits put together to numbers.

The signals themselves are in `signals.py`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import IO

from vcd.gtkw import GTKWSave

from miro_robot.inspect.signals import SIGNALS, Signal

_CLOSED = ("ports",)
"""Groups that are folded at first: most pins are there as what they are wired to already."""
_ZOOM = -22.0  # about one control period on a screen


def write_save_file(out: IO[str], vcd_name: str, signals: Sequence[Signal] = SIGNALS) -> None:
    """Writes the save file for the VCD called `vcd_name` in the same folder. No wall clock, no absolute path."""
    save = GTKWSave(out)
    save.dumpfile(vcd_name, abspath=False)
    save.zoom_markers(_ZOOM)
    save.sst_expanded(False)
    for scope in dict.fromkeys(signal.scope for signal in signals):
        with save.group(scope or "link", closed=scope in _CLOSED):
            for signal in signals:
                if signal.scope == scope:
                    _trace(save, signal)


def _trace(save: GTKWSave, signal: Signal) -> None:
    wires = [signal.path(wire) for wire in signal.wires()]
    if signal.bits == 1:
        save.trace(wires[0])
        return
    name = f"{signal.name.rstrip('_')}[{signal.bits - 1}:0]"
    save.trace_combined(name, wires[::-1], datafmt="dec" if "magnitude" in name else "hex")
