"""A rule: one sentence of the protocol that binds a robot, and how it is tried."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import msgspec

from miro_robot.faults import FaultKind
from miro_robot.lm629.options import DEFAULT_OPTIONS, Lm629Options

if TYPE_CHECKING:
    from miro_robot.image import Image
    from mirotwin.conform.trial_script import TrialScript

    Written = Callable[[TrialScript], None]


# The pages and sections that rules come from.
FRAME = "protocol/README.md, Frame"
TURNS = "protocol/README.md, Turns"
VERSIONS = "protocol/README.md, Versions"
WHY = "protocol/README.md, Why"
RECEPTION = "protocol/README.md, Reception"
FRESHNESS = "protocol/README.md, Freshness and failsafe"
POWER_ON = "robot_fw/README.md, After power-on"
PORT = "robot_fw/README.md, LM629: the port"
WHEELS = "robot_fw/README.md, From LM629 to wheel"
FIRMWARE = "robot_fw/README.md, The firmware"
FAULTS = "robot_fw/README.md, Faults: what firmware must not do"


class Topology(msgspec.Struct, frozen=True):
    """A network of `robots` slots with a robot in each of `slots`, and a radio without errors.

    `keyed`: the carrier is on for frames only and the receiver hears noise in between; else it is on all the time.
    `baud_offset_ppm`: speed error of the host's serial port, positive is faster. `strap`: value on the slot pins of its
    robots, if not their slots.
    """

    robots: int = 3
    slots: tuple[int, ...] = (1,)
    keyed: bool = False
    baud_offset_ppm: int = 0
    strap: int | None = None


BOTH = (Topology(3, (1,)), Topology(5, (3,)))
"""A robot in either layout."""
THREE = (Topology(3, (1,)),)
"""One robot, for rules that do not depend on the layout."""


class Rule(msgspec.Struct, frozen=True):
    """`source` is the page and section that it comes from.

    `write` writes the trial: the frames of a network's host and the required reactions of its robots. It is called for
    each of `topologies`. Its name is the rule's name, and its docstring is the rule, a sentence with MUST.

    `faults`: kinds of firmware fault that break this rule, in its own trial and in those of others. `lm629`: the chips
    of its robots. `presupposes`: ids of rules that its trial depends on; if one of them failed, this rule is not
    judged. `broken`: the behaviour of firmware that breaks it, in words, for rules that others presuppose. `probe`:
    examines such firmware in the given network; returns a text, or "".
    """

    id: str
    source: str
    write: Written
    topologies: tuple[Topology, ...] = BOTH
    faults: tuple[FaultKind, ...] = ()
    lm629: Lm629Options = DEFAULT_OPTIONS
    presupposes: tuple[str, ...] = ()
    broken: str = ""
    probe: Callable[[int, Image, int], str] | None = None

    @property
    def name(self) -> str:
        """A few words, for tables."""
        return self.write.__name__.replace("_", " ")

    @property
    def text(self) -> str:
        return " ".join((self.write.__doc__ or "").split())


class Chapter:
    """Collects the rules of a file: `@chapter.rule("P03", SOURCE, presupposes="P01 P02")` before each function."""

    def __init__(self, title: str) -> None:
        self.title = title
        self.rules: list[Rule] = []

    def rule(self, id: str, source: str, presupposes: str = "", **more: Any) -> Callable[[Written], Written]:
        """`more`: other fields of the rule."""

        def keep(write: Written) -> Written:
            self.rules.append(Rule(id, source, write, presupposes=tuple(presupposes.split()), **more))
            return write

        return keep
