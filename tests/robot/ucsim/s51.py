"""Driving ucsim's `s51 -t C52`: images in, commands in, the state after each command out.

What to run and what to compare is in `walk.py` and `lockstep.py`. The simulator is started once for thousands of
commands: `exec FILE` echoes each command before its output, and `dump /b` prints raw bytes, so the output can be cut
without guessing.
"""

import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

from tests import children
from tests.robot.mcs51.asm import hex_text

OBSERVE = ("step", "dump /b iram 0 255", "dump /b sfr 128 255")
_STOPPED = re.compile(rb"Stop at 0x([0-9a-f]+): \(\d+\) stepped (\d+) ticks\n")


class Observed(NamedTuple):
    """The simulator after one or more instructions."""

    pc: int
    ticks: int  # of the 24 MHz crystal, spent in this step
    iram: bytes
    sfr: bytes  # 80h..FFh


def installed():
    return shutil.which("s51") is not None


def version():
    """The first line of its version, with name and number."""
    return children.run(["s51", "-V"], capture_output=True, text=True, check=True).stdout.splitlines()[0]


def run(code, commands, heard=None):
    """Starts the simulator on a code image at address 0, executes `commands`, returns all it printed.

    `heard`: file for what the program sends.
    """
    serial = [] if heard is None else ["-S", f"uart=0,out={heard}"]
    with tempfile.TemporaryDirectory() as folder:
        image = Path(folder, "image.ihx")
        image.write_text(hex_text(code))
        script = Path(folder, "commands")
        script.write_text("\n".join(commands) + "\n")
        printed = Path(folder, "printed")
        with printed.open("wb") as sink:  # it writes byte by byte: a pipe would wake its reader each time
            children.run(
                ["s51", "-t", "C52", "-b", "-q", "-P", *serial, str(image)],
                input=f'exec "{script}"\nquit\n'.encode(),
                stdout=sink,
                stderr=subprocess.STDOUT,
                check=True,
            )
        return printed.read_bytes()


class Reader:
    """Cuts an output at the echoes of its commands, in order."""

    def __init__(self, output):
        self.output = output
        self.at = 0

    def after(self, echo):
        """Moves behind the next echo of a command."""
        text = echo.encode() + b"\n"
        found = self.output.find(text, self.at)
        if found < 0:
            raise ValueError(f"no `{echo}` in {self.output[self.at : self.at + 400]!r}")
        self.at = found + len(text)
        return self.at

    def raw(self, echo, size):
        """The `size` bytes that a `dump /b` command printed."""
        first = self.after(echo)
        self.at = first + size
        return self.output[first : self.at]

    def observed(self, step=OBSERVE[0]):
        """The outputs of the commands OBSERVE; `step` where the first was another one."""
        first = self.after(step)
        stopped = _STOPPED.search(self.output, first, first + 2000)
        if stopped is None:
            raise ValueError(f"`{step}` printed {self.output[first : first + 400]!r}")
        iram = self.raw(OBSERVE[1], 256)
        sfr = self.raw(OBSERVE[2], 128)
        return Observed(int(stopped[1], 16), int(stopped[2]), iram, sfr)


def differences(seen, pc, iram, registers, by="ours"):
    """What the simulator holds otherwise than `by`, a text each; `registers` are values by address."""
    if pc != seen.pc:
        yield f"PC {by} {pc:04X}h ucsim {seen.pc:04X}h"
    for address in range(256):
        if iram[address] != seen.iram[address]:
            yield f"internal RAM {address:02X}h {by} {iram[address]:02X}h ucsim {seen.iram[address]:02X}h"
    for address, value in registers.items():
        theirs = seen.sfr[address - 0x80]
        if value != theirs:
            yield f"{address:02X}h {by} {value:02X}h ucsim {theirs:02X}h"


def cpu_differences(seen, cpu, addresses):
    """The same of a CPU of ours and the registers at these addresses."""
    iram = bytes(map(cpu.peek_iram, range(256)))
    return differences(seen, cpu.pc, iram, {address: cpu.sfr(address) for address in addresses})
