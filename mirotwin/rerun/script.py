"""What is sent again: the script of a recording or of a stream file, and the scenario that a stream runs in.

The bytes go in before the radio: with the recorded seed it disturbs them as it did then.
"""

from collections.abc import Iterable, Sequence

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.clock import CONTROL_PERIOD_TICKS, TICKS_PER_SECOND, seconds, ticks
from miro_protocol.actions import Power, Reset, ScriptItem
from miro_protocol.events import Received
from miro_protocol.stream_header import Header
from miro_protocol.table import ROBOT_COUNTS
from miro_protocol.transmission import DOWN, Transmission
from miro_sim.periods import Period
from miro_sim.radio.params import Radio
from miro_sim.scenario.errors import ScenarioError
from miro_sim.scenario.file import builtin_names, load, of_table
from miro_sim.scenario.keys import MAX_NETWORKS, NetworkSpec, Scenario

DEFAULT_SCENARIO = "fig6"
AFTERMATH_TICKS = TICKS_PER_SECOND
LONGEST_TICKS = 86_400 * TICKS_PER_SECOND


def script_of(periods: Iterable[Period]) -> list[ScriptItem]:
    """Everything the hosts of a recording sent, and what was done to robots and radios."""
    found: list[ScriptItem] = []
    for period in periods:
        found += [*period.wire, *period.actions]
    return script_of_stream(sorted(found, key=lambda one: one.tick))


def script_of_stream(lines: Iterable[ScriptItem]) -> list[ScriptItem]:
    """Everything that is sent or done to robots."""
    return [one for one in lines if not isinstance(one, Transmission) or one.direction == DOWN]


def sent_in(script: Iterable[ScriptItem]) -> list[Transmission]:
    """Only what hosts send."""
    return [one for one in script if isinstance(one, Transmission) and one.direction == DOWN]


def check_script(script: Sequence[ScriptItem], path: str, networks: int) -> None:
    """Raises BadInput for transmissions of a network that overlap, or that is not there."""
    before: dict[int, Transmission] = {}
    for one in script:
        if one.network >= networks:
            what = f"network {one.network}, but the scenario has {networks}, numbered from 0"
            raise BadInput(path, f"tick {one.tick}", what)
        if not isinstance(one, Transmission):
            continue
        last = before.get(one.network)
        if last is not None and one.tick < last.end_tick:
            what = f"starts before the transmission of tick {last.tick} has ended (tick {last.end_tick})"
            raise BadInput(path, f"tick {one.tick}", what, "move it back")
        before[one.network] = one


def check_actions(script: Sequence[ScriptItem], path: str, scenario: Scenario) -> None:
    """Raises BadInput for what is done to a robot that is not there."""
    for one in script:
        if isinstance(one, Reset | Power):
            slots = [robot.slot for robot in scenario.networks[one.network].robot]
            if one.slot not in slots:
                there = f"there is {', '.join(map(str, slots))}"
                raise BadInput(path, f"tick {one.tick}", f"no robot in slot {one.slot}; {there}")


def robots_of_stream(sent: Iterable[ScriptItem]) -> int:
    """3 or 5: the layout in which more of the frames from hosts can be read."""
    script = sent_in(sent)
    counts = {robots: _frames(script, robots) for robots in ROBOT_COUNTS}
    return 5 if counts[5] > counts[3] else 3


def _frames(script: Iterable[Transmission], robots: int) -> int:
    from miro_protocol.decoder import Decoder  # a hot module: not before the engine was chosen

    decoder = Decoder(robots)
    return len([event for one in script for event in decoder.hear(one) if isinstance(event, Received)])


def scenario_of_stream(sent: Sequence[ScriptItem], path: str, header: Header | None = None) -> Scenario:
    """The scenario that the header names or holds; without one the default scenario with an ideal link.

    Raises BadInput for a stream with nothing to send, for transmissions that overlap, that take more than a
    day, or that have no place in the scenario of the header; ScenarioError for that scenario.
    """
    if header is not None and header.bare is not None:
        what = "is for a bare processor and not for the robot"
        raise BadInput(path, "header: bare", what, "`mirotwin replay FILE --firmware IMAGE.ihx` plays it")
    script = script_of_stream(sent)
    if not script and (header is None or header.scenario is None):
        raise BadInput(path, "", "no line from host to robot", "nothing can be replayed")
    if header is None or header.scenario is None:
        check_script(script, path, MAX_NETWORKS)
        return _default_scenario(script, path)
    scenario = _scenario_of_header(header.scenario, f"{path}: header: scenario")
    check_script(script, path, len(scenario.networks))
    check_actions(script, path, scenario)
    end_tick = -(-ticks(scenario.duration_s) // CONTROL_PERIOD_TICKS) * CONTROL_PERIOD_TICKS
    for one in script:
        # What was recorded may still be on the air when its run ends.
        last_tick = one.end_tick if isinstance(one, Transmission) and header.end_tick is None else one.tick
        if last_tick > end_tick:
            what = f"ends at tick {last_tick}, but the scenario ends at tick {end_tick}"
            raise BadInput(path, f"tick {one.tick}", what, "raise its duration_s")
    return scenario


def _scenario_of_header(scenario: str | dict[str, object], place: str) -> Scenario:
    if not isinstance(scenario, str):
        return of_table(scenario, place)
    if scenario not in builtin_names():
        remedy = f"give one of {', '.join(builtin_names())}, or a whole scenario as a table"
        raise ScenarioError(place, "", f"{scenario[:40]!r} is no built-in scenario", remedy)
    return load(scenario, ["expect={}"]).scenario  # which its own controller is to fulfil


def _default_scenario(script: Sequence[ScriptItem], path: str) -> Scenario:
    """The default one with ideal links, and its robot in every slot of each network's layout, all at one start.

    Runs for a second longer than the stream, so that the failsafe is seen.
    """
    ends = [one.end_tick if isinstance(one, Transmission) else one.tick for one in script]
    end_tick = max(ends) + AFTERMATH_TICKS
    if end_tick > LONGEST_TICKS:
        last = max(one.tick for one in script)
        raise BadInput(path, f"tick {last}", "more than a day", "let the stream start near tick 0")
    count = 1 + max(one.network for one in script)
    settings = ["camera={kind = 'gaussian'}", "expect={}"]  # nothing steers by it, or is said of it
    base = load(DEFAULT_SCENARIO, settings).scenario
    model = base.networks[0].robot[0]
    assert isinstance(model.reference, msgspec.Struct)  # parameters of a line
    standing = msgspec.structs.replace(model.reference, drive_s=0.0)  # nothing steers by it
    model = msgspec.structs.replace(model, wheel_radius_mismatch=0.0, reference=standing)
    networks = []
    for index in range(count):
        robots = robots_of_stream(one for one in script if one.network == index)
        network = NetworkSpec(
            robots=5 if robots == 5 else 3,
            radio=Radio(bit_error_rate=0.0, carrier="on", squelch=True),
            robot=tuple(msgspec.structs.replace(model, slot=slot) for slot in range(robots)),
        )
        networks.append(network)
    periods = -(-end_tick // CONTROL_PERIOD_TICKS)
    duration_s = seconds(periods * CONTROL_PERIOD_TICKS)
    return msgspec.structs.replace(base, name="stream", duration_s=duration_s, networks=tuple(networks))
