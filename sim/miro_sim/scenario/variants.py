"""Variants: named amounts of disturbance for a whole scenario, `ideal` and `realistic`.

Two rules. On the command line (`--set variant=ideal`) a variant overrides the file, because the user asks for it: all
keys that disturb are taken out of the scenario, and those of the variant put in; settings after it win over it. In a
file (`variant = "ideal"`) it is a default: keys that the file gives win.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from miro_sim.scenario.plugins import table_of
from miro_sim.scenario.profiles import named, overridden

Table = dict[str, Any]

DISTURBING_CAMERA = (
    *("kind", "calibration", "calibration_errors", "picture", "delay_frames", "dropped_frames"),
    *("repeated_frames", "lost_robots", "position_error_cm", "heading_error_deg", "pixel_cm"),
)
"""Keys that a variant removes from `[camera]`; lens, pattern, window and ball stay if the kind of camera is
unchanged.
"""
STAYS_IN_RADIO = ("telemetry", "channel")
DISTURBING_DRIVE = ("tyre", "ball", "disturbance")
DISTURBING_CHASSIS = (
    *("left_radius_factor", "right_radius_factor", "stiction_ratio"),
    *("gear_backlash_rad", "gear_load_friction"),
)


def impose(raw: Table, name: object) -> None:
    """Makes the tables of a scenario those of the variant, whatever they say. Raises Refused."""
    variant = named("variant", name)
    raw.pop("variant", None)
    if "camera" in variant:
        raw["camera"] = dict(variant["camera"])
    else:
        _take_out(raw.get("camera"), DISTURBING_CAMERA)
        raw["camera"] = {"kind": "pixels", **table_of(raw.get("camera"))}
    raw["host"] = dict(variant.get("host", {}))
    for network in tables_in(raw, "network"):
        radio = table_of(network.get("radio"))
        kept = {key: radio[key] for key in STAYS_IN_RADIO if key in radio}
        network["radio"] = {**kept, **variant.get("radio", {})}
        network.pop("control_noise", None)
        for robot in tables_in(network, "robot"):
            _take_out(robot, ("wheel_radius_mismatch",))
            _take_out(robot.get("drive"), DISTURBING_DRIVE)
            _take_out(table_of(robot.get("drive")).get("chassis"), DISTURBING_CHASSIS)
            robot.update(variant.get("robot", {}))


def with_variant(raw: Table) -> Table:
    """The tables with the values of the file's variant where the file gives none. Raises Refused.

    A camera of another kind, and a radio with a profile, are what the file says.
    """
    variant = named("variant", raw["variant"])
    complete = {key: value for key, value in raw.items() if key != "variant"}
    complete["camera"] = _camera(raw.get("camera", {}), variant.get("camera", {}))
    complete["host"] = _filled(raw.get("host", {}), variant.get("host", {}))
    networks = raw.get("network")
    if isinstance(networks, list):
        complete["network"] = [_network(network, variant) for network in networks]
    return complete


def _network(network: Any, variant: Mapping[str, Any]) -> Any:
    if not isinstance(network, dict):
        return network
    complete, radio, robots = dict(network), network.get("radio", {}), network.get("robot")
    if isinstance(radio, dict) and "profile" not in radio:
        complete["radio"] = overridden(variant.get("radio", {}), radio)
    if isinstance(robots, list):
        complete["robot"] = [_filled(robot, variant.get("robot", {})) for robot in robots]
    return complete


def _camera(given: Any, default: Table) -> Any:
    same = not given or (isinstance(given, dict) and given.get("kind") == default.get("kind"))
    return _filled(given, default) if same else given


def _filled(given: Any, default: Table) -> Any:
    return {**default, **given} if isinstance(given, dict) else given


def _take_out(table: object, keys: tuple[str, ...]) -> None:
    if isinstance(table, dict):
        for key in keys:
            table.pop(key, None)


def tables_in(above: Table, key: str) -> Iterator[Table]:
    """The tables of a list of tables; what has another shape is left to whoever checks the scenario."""
    listed = above.get(key)
    return iter([table for table in listed if isinstance(table, dict)] if isinstance(listed, list) else [])
