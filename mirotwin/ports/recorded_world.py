"""The world behind an open `miro://` port, and the files that it leaves."""

from __future__ import annotations

import atexit
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import NoReturn

from serial.serialutil import SerialException

from miro_exact.bad_input import BadInput
from miro_sim.periods import Period
from miro_sim.scenario.file import ScenarioText, live_scenario
from miro_sim.world.world import World
from mirotwin.ports.url import UrlOptions
from mirotwin.recording.recorder import Recorder, source_of
from mirotwin.rerun.pacing import Every
from mirotwin.shell.firmware_image import load_firmware
from mirotwin.shell.outputs import KEPT, RECORDING, OutputFolder

FLUSH_S = 0.2


class RecordedWorld:
    """A world at tick 0 and, with `folder`, its recording until `close`."""

    def __init__(self, world: World, text: ScenarioText, seed: int, folder: OutputFolder | None) -> None:
        self.world = world
        self._files = ExitStack()
        self._recorder: Recorder | None = None
        self._flush = Every(FLUSH_S)
        if folder is not None:
            self._record(text, seed, folder)

    def _record(self, text: ScenarioText, seed: int, folder: OutputFolder) -> None:
        source = source_of(text, self.world)
        with ExitStack() as files:
            files.enter_context(folder)
            folder.keep = KEPT
            stream = files.enter_context(folder.part(RECORDING).open("wb", buffering=0))
            self._recorder = files.enter_context(Recorder(stream, source))
            self._files = files.pop_all()
        self.world.observers.append(self._write)

    def _write(self, period: Period) -> None:
        assert self._recorder is not None
        try:
            self._recorder.write(period)
            if self._flush.due():
                self._recorder.flush()
        except OSError as error:
            self._break_off(error)

    def _break_off(self, error: OSError) -> NoReturn:
        """What was recorded stays, as a part."""
        self._recorder = None
        self.world.observers.remove(self._write)
        try:
            self._files.__exit__(type(error), error, error.__traceback__)
        except (BadInput, OSError) as told:
            raise SerialException(str(told)) from None
        raise error

    def close(self) -> None:
        """Ends the control period and the recording, whose file then has its name. Raises SerialException."""
        if self._recorder is None:
            return
        if self.world.in_period and not self.world.stopped:
            self.world.run_to(self.world.period_end)
        try:
            self._recorder.write_faults(self.world.robots)
            self._recorder.flush()
        except OSError as error:
            self._break_off(error)
        self._recorder = None
        try:
            self._files.close()
        except (BadInput, OSError) as told:
            raise SerialException(str(told)) from None


def open_world(options: UrlOptions, at_exit: Callable[[], object]) -> RecordedWorld:
    """The world that `options` ask for. A program that records and ends without closing calls `at_exit`.

    Raises BadInput, or ValueError for a network that the scenario does not have.
    """
    text = live_scenario(options.scenario, options.settings)
    image = load_firmware(options.firmware, named=False)
    world = World(text.scenario, options.seed, image)
    world.earliest_tick(options.network)  # refuses a network that is not there
    if not options.out:
        return RecordedWorld(world, text, options.seed, None)
    recorded = RecordedWorld(world, text, options.seed, OutputFolder(Path(options.out)))
    atexit.register(at_exit)
    return recorded
