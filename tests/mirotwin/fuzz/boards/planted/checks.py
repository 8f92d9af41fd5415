"""What owners expect of a car and of a rover at the end of a run, when the last put is --after long ago."""

from __future__ import annotations

from typing import Any

from mirotwin.verify.checks.interface import Check, Monitor

NEAR_CM = 20.0


class StandsBeforeObstacles(Check, frozen=True, kw_only=True, tag="stands_before_obstacles"):
    """The car does not drive where an obstacle is near."""

    KIND = "safety"
    SUBJECTS = ("board",)

    def monitor(self, subject: Any) -> Monitor[Any]:
        return StandsMonitor(self, subject)


class StandsMonitor(Monitor[StandsBeforeObstacles]):
    def end(self, tick: int) -> None:
        value = self.subject.device.value
        if value("eyes.echo") == "normal" and value("eyes.distance_cm") < NEAR_CM:
            self.judged += 1
            if value("bridge.a.duty") > 0:
                self.fail(tick, f"motors off below {NEAR_CM:g} cm", "driving")


class StandsWithoutEcho(Check, frozen=True, kw_only=True, tag="stands_without_echo"):
    """The rover does not drive while its sensor says nothing."""

    KIND = "safety"
    SUBJECTS = ("board",)

    def monitor(self, subject: Any) -> Monitor[Any]:
        return EchoMonitor(self, subject)


class EchoMonitor(Monitor[StandsWithoutEcho]):
    def end(self, tick: int) -> None:
        value = self.subject.device.value
        if value("eyes.echo") in ("low", "none"):
            self.judged += 1
            if value("bridge.a.mode") == "forward":
                self.fail(tick, "motors off without an echo", "driving ahead")
