"""Feeds the checks of a run while it is under way, and shows the results.

    checks = Checks(world)
    while not world.finished:
        world.step()
    checks.finish()
    checks.check()  # raises ExpectationFailed; or look at `failures`, `verdicts()`

The world calls its observers at the end of each control period. Parts of a board run ahead of each other, so only
events before the world's present tick are passed on, in the order of ticks; the others wait for the next call. A wait
(`World.run_until`) may log an event twice and remove it again; at the end of a period each is in the log once. Nothing
here changes a bit of the run. If all monitors allow it, several control periods are passed on together, because after
each simulated period the caches contain none of this code and data.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import attrgetter
from typing import Any

import msgspec

from miro_exact.plugins import PluginError
from miro_exact.raised import raised
from miro_protocol.events import Damaged, Received
from miro_protocol.robot_receiver import RobotReceiver
from miro_sim.periods import Period, RobotId
from miro_sim.world.device import Device
from miro_sim.world.events import Cursor, Event
from miro_sim.world.medium import Medium
from miro_sim.world.network import Network
from miro_sim.world.world import World
from mirotwin.shell.verdicts import Verdict, judge
from mirotwin.verify.checks.expect import ALWAYS_ON, expectations_of, named_in
from mirotwin.verify.checks.interface import (
    Check,
    Expectation,
    Failure,
    FirstFailure,
    Monitor,
    Subject,
    checked_monitor,
)
from mirotwin.verify.checks.sleep import Sleep


def reception(received: Event, decoded: Received | Damaged, fresh: bool | None) -> Event:
    """The `frame` or `damaged` event that a `received` one completes, at its tick."""
    frame = decoded if isinstance(decoded, Received) else None
    return Event(
        tick=received.tick,
        what="damaged" if frame is None else "frame",
        network=received.network,
        slot=received.slot,
        value=int(bool(fresh)),
        data=decoded.data,
        frame=frame,
    )


Expected = Mapping[RobotId, Sequence[Check]]
_FROM_RECEIVED = ("frame", "damaged")
_RESTARTS = ("reset", "power")
_FROM_PC = ("sent", "heard", "answer", "touch", "radio", *_RESTARTS)
_BY_TICK = attrgetter("tick")
TOGETHER = 30
"""Largest number of control periods in one batch, for monitors that listen to no board: its log is full sooner."""


class ExpectationFailed(AssertionError):
    """Checks failed: one line for each failure."""

    def __init__(self, failures: Sequence[Failure]) -> None:
        super().__init__("\n".join(map(str, failures)))
        self.failures = list(failures)


class Checks:
    """The checks of a world from now on: its scenario's expectations on each robot, and the always-on checks.

    `expected` replaces both, by network and slot. `cut`: the run may be stopped before its end. `named`: the checks
    that the user named. Create it at the start of the run: a check does not know earlier orders to the wheels. Raises
    RuntimeError if the world is loaded meanwhile, because a check's memory is not saved.
    """

    def __init__(self, world: World, expected: Expected | None = None, cut: bool = False) -> None:
        self.world = world
        if expected is None:
            expected = expectations_of(world.scenario, world.scenario.name)
        names = {check.name for checks in expected.values() for check in checks}
        self.named = names - (set(ALWAYS_ON) - named_in(world.scenario))
        self.cut = cut
        self.devices = [
            _DeviceMonitors(world, line, device, expected.get((line.index, device.slot), ()), cut)
            for line in world.lines
            for device in line.devices
        ]
        self._each(_DeviceMonitors.begin)
        self.at_ends = [
            (robot, monitor) for robot in self.devices for monitor in robot.that_have("period_over")
        ]
        self.finished = False
        self.index = world.index
        self.unreported: list[tuple[Period, int]] = []  # and where the world stood at their end
        self.together = TOGETHER if all(watched.later for watched in self.devices) else 1
        world.observers.append(self._look)

    def _look(self, period: Period) -> None:
        if period.index != self.index:
            raise RuntimeError(
                f"control period {period.index} follows {self.index - 1}: the world was loaded; begin new checks then"
            )
        self.index += 1
        self.unreported.append((period, self.world.tick))
        try:  # without a call that could be saved: after a simulated period the caches hold nothing of this
            for judge_and_monitor in self.at_ends:
                judge_and_monitor[1].period_over()
        except (Exception, SystemExit) as error:
            raise judge_and_monitor[0].cannot_judge(judge_and_monitor[1].check, error) from error
        if len(self.unreported) >= self.together:
            self._report()

    def _report(self) -> None:
        """Reports the control periods that were not reported yet."""
        unreported, self.unreported = self.unreported, []
        self._each(lambda watched: watched.look(unreported))

    def finish(self) -> None:
        """Ends the checks, after a complete or interrupted run."""
        if not self.finished:
            self.finished = True
            self.world.observers.remove(self._look)
            self._report()
            self._each(_DeviceMonitors.end)

    def _each(self, tell: Callable[[_DeviceMonitors], None]) -> None:
        """Calls `tell` for each device. A user's monitor that raises becomes a PluginError with its name."""
        for watched in self.devices:
            try:
                tell(watched)
            except (Exception, SystemExit) as error:
                raise watched.cannot_judge(watched.check, error) from error

    @property
    def monitors(self) -> list[Monitor[Any]]:
        self._report()
        return [monitor for watched in self.devices for monitor in watched.monitors]

    @property
    def failures(self) -> list[Failure]:
        """All failures that were saved, in the order of time."""
        return sorted((failure for monitor in self.monitors for failure in monitor.failures), key=_BY_TICK)

    def check(self) -> None:
        """Raises ExpectationFailed if a check has failed."""
        if self.failures:
            raise ExpectationFailed(self.failures)

    def verdicts(self) -> tuple[Expectation, ...]:
        """One result for each name, over all robots, in the order of the expectations."""
        by_name: dict[str, list[Monitor[Any]]] = {}
        for monitor in self.monitors:
            by_name.setdefault(monitor.check.name, []).append(monitor)
        lost = any(watched.lost for watched in self.devices)
        reason = ENDED if self.ended_early else NO_OCCASION
        return tuple(_verdict(name, monitors, lost, reason) for name, monitors in by_name.items())

    @property
    def ended_early(self) -> bool:
        """True if the run was stopped before its end: missing later events count neither for nor against it."""
        return self.cut and self.world.tick < self.world.periods * self.world.period_ticks

    @property
    def sleep(self) -> Sleep | None:
        """The sleep of a board alone; the driver of the run stops at the ticks that it needs."""
        return self.devices[0].subject.sleep

    def verdict(self) -> Verdict:
        """Of all checks together. Those that are always on, and are named by nobody, need no occasion."""
        faults = ["fault" for failure in self.failures if failure.fault]
        named = () if self.ended_early else self.named
        verdicts = self.verdicts()
        return judge(
            [*faults, *(verdict.verdict for verdict in verdicts if verdict.name in named)],
            (verdict.verdict for verdict in verdicts if verdict.name not in named),
        )


class _DeviceMonitors:
    """One device and its monitors. `check`: owner of the monitor being called.

    `lost`: events that had already left the log when they were requested.
    """

    def __init__(
        self, world: World, line: Medium, device: Device, checks: Sequence[Check], cut: bool
    ) -> None:
        self.world = world
        self.line = line
        self.device = device
        self.place = world.devices.index(device)
        self.checks = checks
        self.subject = _subject(world, line, device, cut)
        self.monitors: list[Monitor[Any]] = []
        self.of_events: dict[str, list[Monitor[Any]]] = {}
        self.receiver: RobotReceiver | None = None
        self.of_board, self.of_pc = Cursor(device.log), Cursor(line.log)
        self.faults = len(device.board.faults)
        self.waiting: list[Event] = []
        self.lost = 0

    def begin(self) -> None:
        """Makes the monitors."""
        for check in self.checks:
            self.check = check
            monitor = self._monitor(check)
            self.monitors.append(monitor)
            for kind in monitor.EVENTS:
                self.of_events.setdefault(kind, []).append(monitor)
        self.of_ends, self.of_periods, self.of_times = map(self.that_have, ("period_over", "period", "until"))
        self.pc_kinds = {*_RESTARTS, *(kind for kind in self.of_events if kind in _FROM_PC)}
        self.board_kinds = {kind for kind in self.of_events if kind not in _FROM_PC}
        if any(kind in self.of_events for kind in _FROM_RECEIVED):
            self.receiver = self._receiver()
            self.board_kinds.add("received")
        self.later = not self.board_kinds and all(monitor.LATER for monitor in self.monitors)

    def _monitor(self, check: Check) -> Monitor[Any]:
        kind = "board" if self.subject.alone else "robot"
        if kind in check.SUBJECTS:
            return checked_monitor(check, self.subject)
        monitor: Monitor[Any] = Monitor(check, self.subject)
        monitor.unseen = "it judges robots" if self.subject.alone else "it judges a board alone"
        return monitor

    def _receiver(self) -> RobotReceiver | None:
        return RobotReceiver(self.subject.robots) if self.subject.robots else None

    def that_have(self, method: str) -> list[Monitor[Any]]:
        """The monitors with a method of their own; telling the others would cost time."""
        return [
            monitor
            for monitor in self.monitors
            if getattr(type(monitor), method) is not getattr(Monitor, method)
        ]

    def look(self, periods: Sequence[tuple[Period, int]]) -> None:
        """Tells the monitors of control periods, each with the first tick after it."""
        faults = self.device.board.faults
        for fault in faults[self.faults :]:
            for monitor in self.monitors:
                self.check = monitor.check
                monitor.fault(fault)
        self.faults = len(faults)
        self._gather()
        for period, tick in periods:
            for monitor in self.of_periods:
                self.check = monitor.check
                monitor.period(period.robots[self.place], period.tick)
            self._report(tick)

    def _gather(self) -> None:
        """Reports the new entries of the logs."""
        for log, kinds in ((self.of_pc, self.pc_kinds), (self.of_board, self.board_kinds)):
            if kinds:
                self.lost += log.lost
                self.waiting += [event for _, event in log.read(kinds)]
        self.waiting.sort(key=_BY_TICK)

    def _report(self, tick: int) -> None:
        """Tells of the events before `tick`, in the order of time."""
        delivered = 0
        for event in self.waiting:
            if event.tick >= tick:
                break
            delivered += 1
            if event.what in _RESTARTS:
                if event.slot != self.device.slot:
                    continue
                self._restart(event.tick)
            self._report_one(event)
            if event.what == "received" and self.receiver is not None:
                for received in self.receiver.character(event.value, event.good_stop, event.tick):
                    self._report_one(reception(event, *received))
        del self.waiting[:delivered]
        for monitor in self.of_times:
            self.check = monitor.check
            monitor.until(tick)

    def _restart(self, tick: int) -> None:
        if self.receiver is not None:
            self.receiver = self._receiver()
        for monitor in self.monitors:
            self.check = monitor.check
            monitor.restarted(tick)

    def _report_one(self, event: Event) -> None:
        if event.tick < self.subject.begin_tick:
            return
        for monitor in self.of_events.get(event.what, ()):
            self.check = monitor.check
            monitor.event(event)

    def end(self) -> None:
        """The run is over, perhaps within a control period."""
        tick = self.world.tick
        self.look(())
        self._report(tick + 1)
        for monitor in self.monitors:
            self.check = monitor.check
            monitor.end(tick)

    def cannot_judge(self, check: Check, error: BaseException) -> PluginError:
        """The error to raise in place of an exception of a check."""
        place = "" if self.subject.alone else f"net{self.line.index}/robot{self.device.slot}: "
        named = f"{place}check {check.name!r} cannot judge"
        if isinstance(error, PluginError):
            return PluginError(f"{named}: {error.what}", error.remedy)
        return PluginError(f"{named}: {raised(error)}", "repair the check")


def _subject(world: World, line: Medium, device: Device, cut: bool) -> Subject:
    end_tick = world.scenario.end_tick
    if isinstance(line, Network):
        slot = line.devices[0].slot
        return Subject(device, world.image, end_tick, line.spec.robots, slot, line.downlink, cut)
    begin_tick = world.scenario.begin_tick
    sleep = Sleep(device.board.cpu, begin_tick, end_tick)
    hertz = world.clock
    return Subject(device, world.image, end_tick, cut=cut, clock=hertz, begin_tick=begin_tick, sleep=sleep)


NO_OCCASION = "the run had no occasion for it"
ENDED = "the run was ended before it"
LOST = "more events than the robot's log holds"


def _verdict(name: str, monitors: Sequence[Monitor[Any]], lost: bool, reason: str) -> Expectation:
    failed, judged = sum(monitor.failed for monitor in monitors), sum(monitor.judged for monitor in monitors)
    verdict: Verdict = "failed" if failed else "passed"
    if not failed and judged == 0:
        unseen = next((monitor.unseen for monitor in monitors if monitor.unseen), "")
        missed = next((monitor.missed for monitor in monitors if monitor.missed), reason)
        verdict, reason = ("not observable", unseen) if unseen else ("not judged", missed)
    elif not failed and lost and any(monitor.EVENTS for monitor in monitors):
        verdict, reason = "not judged", LOST
    failures = (failure for monitor in monitors for failure in monitor.failures)
    first = min(failures, key=_BY_TICK, default=None)
    return Expectation(
        name=name,
        kind=monitors[0].check.KIND,
        verdict=verdict,
        failures=failed,
        first=None if first is None else msgspec.convert(first, FirstFailure, from_attributes=True),
        reason="" if verdict in ("failed", "passed") else reason,
    )
