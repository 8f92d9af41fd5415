"""Mirotwin: what people do with the world, and the name they import.

    import mirotwin

    image = mirotwin.load_hex(mirotwin.image_path())
    world = mirotwin.World(mirotwin.load_scenario("fig6").scenario, seed=7, image=image)
    answer = world.run_until(mirotwin.conditions.Answer(), within=mirotwin.ticks(0.2))

The names below are loaded on first use: importing this package takes almost no time, and the program
(`entry`) starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from miro_exact.clock import ms as ms
    from miro_exact.clock import seconds as seconds
    from miro_exact.clock import ticks as ticks
    from miro_exact.clock import us as us
    from miro_protocol import frames as frames
    from miro_protocol.decoder import Decoder as Decoder
    from miro_protocol.decoder import TelemetryDecoder as TelemetryDecoder
    from miro_protocol.frames import ServiceFrame as ServiceFrame
    from miro_protocol.frames import TeamFrame as TeamFrame
    from miro_protocol.transmission import Transmission as Transmission
    from miro_robot.firmware import image_path as image_path
    from miro_robot.image import Image as Image
    from miro_robot.image import load_hex as load_hex
    from miro_sim.scenario import file as _scenarios
    from miro_sim.scenario.keys import Scenario as Scenario
    from miro_sim.world import conditions as conditions
    from miro_sim.world.events import Event as Event
    from miro_sim.world.waits import WaitExpired as WaitExpired
    from miro_sim.world.world import World as World
    from mirotwin import campaign as campaign
    from mirotwin import recording as recording
    from mirotwin import replay as replay
    from mirotwin import testing as testing
    from mirotwin.recording import reader as _reader
    from mirotwin.verify.cases.case import Trace as Trace
    from mirotwin.verify.cases.case import case_of_checks as case_of_checks
    from mirotwin.verify.cases.case import write_case as write_case
    from mirotwin.verify.checks.monitors import Checks as Checks
    from mirotwin.verify.checks.monitors import ExpectationFailed as ExpectationFailed

    Telemetry = frames.TelemetryFrame
    load_scenario = _scenarios.load
    parse_scenario = _scenarios.parse
    read_recording = _reader.read

_MODULES = {
    "Checks": "mirotwin.verify.checks.monitors:Checks",
    "Decoder": "miro_protocol.decoder:Decoder",
    "Event": "miro_sim.world.events:Event",
    "ExpectationFailed": "mirotwin.verify.checks.monitors:ExpectationFailed",
    "Image": "miro_robot.image:Image",
    "Scenario": "miro_sim.scenario.keys:Scenario",
    "ServiceFrame": "miro_protocol.frames:ServiceFrame",
    "TeamFrame": "miro_protocol.frames:TeamFrame",
    "Telemetry": "miro_protocol.frames:TelemetryFrame",
    "TelemetryDecoder": "miro_protocol.decoder:TelemetryDecoder",
    "Trace": "mirotwin.verify.cases.case:Trace",
    "Transmission": "miro_protocol.transmission:Transmission",
    "WaitExpired": "miro_sim.world.waits:WaitExpired",
    "World": "miro_sim.world.world:World",
    "campaign": "mirotwin.campaign",
    "case_of_checks": "mirotwin.verify.cases.case:case_of_checks",
    "conditions": "miro_sim.world.conditions",
    "frames": "miro_protocol.frames",
    "image_path": "miro_robot.firmware:image_path",
    "load_hex": "miro_robot.image:load_hex",
    "load_scenario": "miro_sim.scenario.file:load",
    "ms": "miro_exact.clock:ms",
    "parse_scenario": "miro_sim.scenario.file:parse",
    "read_recording": "mirotwin.recording.reader:read",
    "recording": "mirotwin.recording",
    "replay": "mirotwin.replay",
    "seconds": "miro_exact.clock:seconds",
    "testing": "mirotwin.testing",
    "ticks": "miro_exact.clock:ticks",
    "us": "miro_exact.clock:us",
    "write_case": "mirotwin.verify.cases.case:write_case",
}
"""Public name -> the module that it is, or the module and the name in it."""

__all__ = list(_MODULES)  # the types above have the same names: a test compares them


def __getattr__(name: str) -> Any:
    module_and_name = _MODULES.get(name)
    if module_and_name is None:
        raise AttributeError(f"module 'mirotwin' has no attribute {name!r}; it has {', '.join(_MODULES)}")
    module, _, inner = module_and_name.partition(":")
    found = import_module(module)
    value = getattr(found, inner) if inner else found
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
