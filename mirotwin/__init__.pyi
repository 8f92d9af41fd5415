from collections.abc import Callable
from typing import Any

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
from miro_robot.board_spec import BoardSpec as BoardSpec
from miro_robot.firmware import image_path as image_path
from miro_robot.image import Image as Image
from miro_robot.image import load_hex as load_hex
from miro_sim.scenario import file as _scenarios
from miro_sim.scenario.board import BoardScenario as BoardScenario
from miro_sim.scenario.keys import Scenario as Scenario
from miro_sim.scenario.terminal import InputPiece as InputPiece
from miro_sim.scenario.terminal import PinEvent as PinEvent
from miro_sim.scenario.terminal import TerminalSpec as TerminalSpec
from miro_sim.world import conditions as conditions
from miro_sim.world.events import Event as Event
from miro_sim.world.waits import WaitExpired as WaitExpired
from miro_sim.world.world import World as World
from mirotwin.recording import reader as _reader
from mirotwin.verify.cases.case import Trace as Trace
from mirotwin.verify.cases.case import case_of_checks as case_of_checks
from mirotwin.verify.cases.case import write_case as write_case
from mirotwin.verify.checks.monitors import Checks as Checks
from mirotwin.verify.checks.monitors import ExpectationFailed as ExpectationFailed

from . import campaign as campaign
from . import recording as recording
from . import replay as replay
from . import testing as testing

Telemetry = frames.TelemetryFrame
load_scenario = _scenarios.load
parse_scenario = _scenarios.parse
read_recording = _reader.read

__all__: list[str]

def names_of_stub(package: str) -> Callable[[str], Any]: ...
