"""What went in and out of a bare processor during one run, and the checks in Python that judge it.

A check is a function that says what is wrong in one line, or None:

    def level_is_kept(run: Exchange) -> str | None:
        if run.memory["level"] > 100:
            return f"the level is {run.memory['level']}"
        return None

It is named as `mycheck.py:level_is_kept`, or, where a distribution has it, by an entry point:

    [project.entry-points."mirotwin.bare_checks"]
    level_is_kept = "mycheck:level_is_kept"
"""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import msgspec

from miro_exact.bad_input import BadInput, did_you_mean
from miro_exact.installed import entries_of
from miro_exact.plugins import PluginError, installed_part, module_of
from miro_exact.raised import at_place, defined_at, raised
from miro_robot.faults import FirmwareFault
from miro_robot.harness.recording_bus import RecordingBus
from miro_robot.image import Image
from miro_robot.image.c_types import value_of
from miro_robot.image.variables import Variable, Variables, find_variable
from miro_robot.inspect.values import bytes_at
from miro_robot.mcs51.cpu import Cpu

OPTION = "--check"
GROUP = "mirotwin.bare_checks"
NO_FAULT = "no_fault"
NEVER_SLEEPS = "never_sleeps"
"""That the firmware did not go back to sleep. No check of a world has that name: what follows from it is judged."""
OWN = dict.fromkeys((NO_FAULT, NEVER_SLEEPS), "always on")
"""Names that no check in Python may have: a case that says one of them is about our own."""


class Character(NamedTuple):
    """As the serial port had it. `tick`: RI or TI went up, in periods of the crystal since power-on.

    `stop_good`: the stop bit was a mark, so far as the mode of the serial port can tell.
    """

    value: int
    tick: int
    stop_good: bool = True


class MemoryView:
    """The memories of the processor, as they are at the end of the run. Good until the next run."""

    def __init__(self, cpu: Cpu, bus: RecordingBus, image: Image) -> None:
        self._cpu = cpu
        self._bus = bus
        self._image = image
        self._known: dict[str, tuple[Variable, Variables]] = {}  # by the names asked for

    def __getitem__(self, name: str) -> Any:
        """The variable `name` by its C type: int, float, bool, a list for an array, a dict for a struct.

        Names as `file:name`, `name[2]`, `name.x`. Raises BadInput for one that the .cdb beside the image does not know.
        """
        if name not in self._known:
            self._known[name] = find_variable(self._image, name)
        variable, variables = self._known[name]
        return value_of(variable.type, self._bytes(variable), variables.fields(variable))

    def _bytes(self, variable: Variable) -> bytes:
        if variable.space != "xram":
            return bytes_at(self._cpu, self._image, variable)
        return bytes(self._bus.movx_read(variable.address + at, 0) for at in range(variable.type.size))

    @property
    def iram(self) -> bytes:
        return bytes(self._cpu.peek_iram(address) for address in range(0x100))

    @property
    def xram(self) -> bytes:
        return self._bus.content()

    def sfr(self, address: int) -> int:
        """A special function register (80h..FFh; ports: their latch)."""
        return self._cpu.sfr(address)


class Exchange(msgspec.Struct, frozen=True):
    """One run: characters that the serial port took and gave, in the order of time, and what was left behind.

    `begin_tick`: the firmware had started up and the first character could come. `reset_tick`: the processor was reset,
    for the last time, None if it never was. `fault`: the run ended with it.
    """

    received: tuple[Character, ...]
    sent: tuple[Character, ...]
    fault: FirmwareFault | None
    begin_tick: int
    reset_tick: int | None
    end_tick: int
    memory: MemoryView

    @property
    def received_bytes(self) -> bytes:
        return bytes(one.value for one in self.received)

    @property
    def sent_bytes(self) -> bytes:
        return bytes(one.value for one in self.sent)

    @property
    def sent_since_reset(self) -> bytes:
        """What was sent after the last reset, which may have cut something off."""
        return bytes(one.value for one in self.sent if self.reset_tick is None or one.tick > self.reset_tick)


Check = Callable[[Exchange], object]
"""Returns what is wrong, or None."""


class NamedCheck(msgspec.Struct, frozen=True):
    """A check as it was named. `text`: what `check_named` took; `from_file`: the name is that of a file."""

    name: str
    text: str
    function: Check
    from_file: bool

    def judge(self, run: Exchange) -> str | None:
        """What is wrong, in one line. Raises BadInput where the check fails itself."""
        try:
            found = self.function(run)
        except BadInput:
            raise
        except (Exception, SystemExit) as error:
            what = f"raised {raised(error)}"
            raise BadInput("", f"{OPTION} {self.text}", what, "repair the check") from error
        if found is None or isinstance(found, str):
            return None if found is None else " ".join(found.split()) or "failed"
        what = at_place(f"returned {found!r:.40}", defined_at(self.function))
        raise BadInput("", f"{OPTION} {self.text}", what, "return None, or what is wrong as text")


def check_named(text: str) -> NamedCheck:
    """The check that `FILE.py:FUNCTION` or the name of an entry point means, as a user types it. Raises BadInput.

    The file is run: `text` must come from the command line. `installed_check` takes names that stand in files.
    """
    path, _, function = text.rpartition(":")
    if path.endswith(".py"):
        if function in OWN:
            what = f"check {function!r} is in mirotwin (always on), too"
            raise BadInput("", f"{OPTION} {text}", what, "give the function another name")
        return NamedCheck(function, text, _callable(module_of(path, OPTION), function, text), True)
    return installed_check(text)


def installed_entry(name: str) -> Any:
    """What an installed distribution registers under this name. Raises BadInput where two, or we and one, have it."""
    try:
        return installed_part(GROUP, "check", name, OWN.get(name, ""))
    except PluginError as error:
        raise BadInput("", OPTION, error.what, error.remedy) from None


def installed_check(name: str) -> NamedCheck:
    """The check that an installed distribution has under this name. Raises BadInput."""
    entry = installed_entry(name)
    if entry is None:
        names = sorted(one.name for one in entries_of(GROUP))
        remedy = did_you_mean(name, names, f"give FILE.py:FUNCTION{''.join(f', {one}' for one in names)}")
        raise BadInput("", OPTION, f"there is no check {name!r} for a bare processor", remedy)
    try:
        found = entry.load()
    except (Exception, SystemExit) as error:
        what = f"check {name!r} ({entry.value}) cannot be imported: {raised(error)}"
        raise BadInput("", OPTION, what, "repair or uninstall it") from error
    if not callable(found):
        raise BadInput("", OPTION, f"check {name!r} ({entry.value}) is no function", "name a function")
    return NamedCheck(name, name, found, False)


def _callable(module: ModuleType, name: str, text: str) -> Check:
    found: Check | None = getattr(module, name, None)
    if callable(found):
        return found
    names = [
        key for key, value in vars(module).items() if callable(value) and value.__module__ == module.__name__
    ]
    choices = did_you_mean(name, names, f"it has {', '.join(names) or 'none'}")
    raise BadInput(text.rpartition(":")[0], OPTION, f"there is no function {name!r}", choices)
