"""Single keys of a scenario that are set from outside: `KEY=VALUE`, as the command line's `--set` takes them.

KEY is the path of a key, `network.0.robot.0.controller.gamma1_per_s`. An index may be left out where a list has one
entry: `network.robot.controller.gamma1_per_s`. VALUE is read as TOML, and as text if it is none; an inline table
replaces a whole table. `variant=NAME` stands for all that the variant changes (`variants`); `law=NAME` is that of all
robots, unless the scenario names it for one, and so are `estimator=NAME` and `reference=NAME`.
"""

import json
import re
from collections.abc import Iterable, Sequence
from typing import Any

import msgspec

from miro_host.registries import LAWS
from miro_protocol.toml_text import TomlError, value_of
from miro_sim.scenario.errors import Refused, ScenarioError
from miro_sim.scenario.keys import NetworkSpec, RobotSpec
from miro_sim.scenario.plugins import REGISTRIES, table_of
from miro_sim.scenario.profiles import ERROR_KEYS
from miro_sim.scenario.variants import impose, tables_in

Table = dict[str, Any]
_WORD = re.compile(r"[\w-]+")
EXPECT = "expect."
OPTION = "--set"
_TAGS = {registry.key for registry in REGISTRIES.values()}
"""Keys that say which other keys a table has."""
TABLES = {"camera": "kind", "controller": "law", "estimator": "kind", "reference": "kind"}
"""Tables of several kinds, and the key that says which."""
_OF_ALL = {"law": "controller", "estimator": "estimator", "reference": "reference"}
"""Settings that choose the kind of this table for all robots."""
_DEFAULTS = {registry.default for registry in REGISTRIES.values() if registry.default}
"""Names of default plug-ins, which apply to tables without a name."""


class Setting(msgspec.Struct, frozen=True):
    """The effect of a setting. `text`: KEY=VALUE as it was given; `path`: what was set, as in errors:
    `network[0].host`.

    `table`: the table that is the setting's as a whole, because the setting made it or chose its kind; or "".
    `option`: who made it: the command line's, or the key of a scenario file that holds settings.
    `others`: the table itself, where the setting chose another kind than it had; its keys may be those of the old kind.
    """

    text: str
    path: str
    table: str = ""
    option: str = OPTION
    others: Table = msgspec.field(default_factory=dict)

    @property
    def place(self) -> str:
        """Its name in errors."""
        return _option(self.text, self.option)

    def concerns(self, path: str) -> bool:
        """True if an error at this path may be the setting's."""
        ours = [key_path for key_path in (self.path, self.table) if key_path]
        return any(_inside(path, key_path) for key_path in ours) or _inside(self.path, path)


def _option(text: str, option: str) -> str:
    """A setting as it is written on the command line, where `--expect` stands for `--set expect.`, or in a file."""
    if option != OPTION:
        return f"{option}.{text}"
    return " ".join(option_words(text))


def option_words(text: str) -> tuple[str, str]:
    """Option and value of a setting on the command line."""
    return ("--expect", text.removeprefix(EXPECT)) if text.startswith(EXPECT) else (OPTION, text)


def _inside(path: str, above: str) -> bool:
    return path == above or path.startswith((f"{above}.", f"{above}["))


def in_text(table: Table, above: str = "") -> list[str]:
    """The settings KEY=VALUE that a table of them says; a table inside it stands for its keys, if these are words."""
    lines: list[str] = []
    for key, value in table.items():
        path = f"{above}{key}"
        if isinstance(value, dict) and all(_WORD.fullmatch(inner) for inner in value):
            lines += in_text(value, f"{path}.")
        else:
            lines.append(f"{path}={_inline(value)}")
    return lines


def _inline(value: Any) -> str:
    """A value as TOML in one line."""
    import tomli_w  # only tables of settings need it

    if isinstance(value, dict):  # the names of pins are keys with dots
        inner = (f"{json.dumps(key)} = {_inline(entry)}" for key, entry in value.items())
        return f"{{ {', '.join(inner)} }}"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").rstrip()


def make(raw: Table, settings: Iterable[str], origin: str, option: str = OPTION) -> list[Setting]:
    """Makes the settings in the tables of a scenario, in their order. Raises ScenarioError."""
    return [
        msgspec.structs.replace(_make(raw, text, origin, option), text=given)
        for given in settings
        for text in _of_all(raw, given)
    ]


def _of_all(raw: Table, text: str) -> list[str]:
    """`law=NAME` as the settings of all robots, none where one of them has it; any other setting as it is."""
    word, _, value = text.partition("=")
    name = value.strip("\"' ")
    if word not in _OF_ALL:
        return [text]
    table, key = _OF_ALL[word], TABLES[_OF_ALL[word]]
    robots = {
        f"network.{network}.robot.{place}": robot
        for network, team in enumerate(tables_in(raw, "network"))
        for place, robot in enumerate(tables_in(team, "robot"))
    }
    if any(table_of(robot.get(table)).get(key) == name for robot in robots.values()):
        return []
    return [f"{path}.{table}.{key}={value}" for path in robots]


def _make(raw: Table, text: str, origin: str, option: str) -> Setting:
    try:
        keys, value = _read(text)
        if keys == ["variant"]:
            impose(raw, value)
            return Setting(text, "variant", option=option)
        made = _Path(text).put(raw, keys, value, "")
        return msgspec.structs.replace(made, option=option)
    except Refused as error:
        raise ScenarioError(origin, _option(text, option), error.what, error.remedy) from None
    except RecursionError:
        raise ScenarioError(origin, _option(text, option), "nested too deeply") from None


def _read(text: str) -> tuple[list[str], Any]:
    key, equals, value = text.partition("=")
    keys = [part.strip() for part in re.sub(r"\[(\d+)\]", r".\1", key).split(".")]
    if not equals or not all(keys):
        raise Refused("is no setting", "write KEY=VALUE, such as network.radio.latency_s=0.01")
    path = ".".join(keys)
    try:
        text.encode()
        return keys, value_of(value, path)
    except (
        UnicodeEncodeError
    ):  # bytes that no encoding makes text of: Python hands them on as lone surrogates
        raise Refused("is not UTF-8 text", "write the setting in UTF-8, or into a scenario file") from None
    except TomlError as error:
        place = "" if error.place in ("", path) else f"{error.place}: "
        raise Refused(f"{place}{error.what}", error.remedy) from None


class _Path:
    """Goes along the keys of one setting. `table`: the first table on the way that was not there."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.table = ""

    def put(self, at: Any, keys: Sequence[str], value: Any, path: str) -> Setting:
        """Sets the value below `at`, which is at `path`."""
        if isinstance(at, list):
            return self._put_in_list(at, keys, value, path)
        if not isinstance(at, dict):
            raise Refused(f"{path} is a value and has no keys", f"end KEY with {path.rpartition('.')[2]}")
        key, *rest = keys
        key_path = f"{path}.{key}" if path else key
        if rest:
            if key not in at:
                self.table = self.table or key_path
            return self.put(at.setdefault(key, {}), rest, value, key_path)
        below = at.get(key)
        if isinstance(value, dict) and isinstance(below, list) and len(below) == 1:
            return self._put_in_list(below, ["0"], value, key_path)
        others = at if key in _TAGS and _another_kind(at, key, value) else {}
        if key in ERROR_KEYS:  # either says the same: the last one holds
            for other in ERROR_KEYS:
                at.pop(other, None)
        at[key] = value
        return Setting(self.text, key_path, path if key in _TAGS else self.table, others=others)

    def _put_in_list(self, at: list[Any], keys: Sequence[str], value: Any, path: str) -> Setting:
        if not keys[0].isdecimal():
            if len(at) != 1:
                ways = f"name one of them: {path}.0 to {path}.{len(at) - 1}" if at else "give a whole list"
                raise Refused(f"{path} has {len(at)} entries", ways)
            return self.put(at[0], keys, value, f"{path}[0]")
        index, *rest = keys
        number = int(index[:9])
        if number >= len(at):
            problem = f"{path} has {len(at)} {'entry' if len(at) == 1 else 'entries'}, numbered from 0"
            raise Refused(
                problem,
                "give the whole list to add one, or add it to the file that `mirotwin scenarios show NAME` prints",
            )
        key_path = f"{path}[{number}]"
        if rest:
            return self.put(at[number], rest, value, key_path)
        at[number] = value
        return Setting(self.text, key_path, self.table)


def _another_kind(table: Table, key: str, value: Any) -> bool:
    """True if this table has been of another kind than `value`; one that does not say its kind has the default."""
    return table[key] != value if key in table else value not in _DEFAULTS


def drop_other_kind(error: ScenarioError, settings: Sequence[Setting]) -> tuple[str, str] | None:
    """Takes out the key of this error, if it is of a kind that a setting has replaced; that setting, and the key."""
    if error.what != "unknown key":
        return None
    above, _, key = f"{error.place}".rpartition(".")
    for number, setting in enumerate(settings):
        if setting.table != above or key not in setting.others or setting.path == f"{error.place}":
            continue
        if any(_inside(f"{error.place}", later.path) for later in settings[number + 1 :]):
            continue  # it was set on purpose
        del setting.others[key]
        return setting.place, key
    return None


def _deeper(key_path: str, setting: Setting, raw: Table) -> str:
    """The path of a key that was given too far above: at the top, in a network or in a robot."""
    key = key_path.rpartition(".")[2]
    match = re.search(rf"(?:^|\.){re.escape(key)}([.=\[].*)", setting.text, re.DOTALL)
    if match is None or not re.fullmatch(r"(network\[\d+\]\.)?(robot\[\d+\]\.)?[^.\[\]]+", key_path):
        return ""
    network, robot = _robot_near(key_path, raw)
    rest = _with_tag(key, match[1])
    if key == "robot":
        path = robot if not re.match(r"\.\d|\[", rest) else f"{network}.robot"
    elif key == LAWS.key:
        path = f"{robot}.controller.{key}"
    elif key in RobotSpec.__struct_encode_fields__:
        path = f"{robot}.{key}"
    elif key in NetworkSpec.__struct_encode_fields__:
        path = f"{network}.{key}"
    else:
        return ""
    return f"write {_option(path + rest, setting.option)}"


def _with_tag(key: str, rest: str) -> str:
    """The rest of a key in a setting; a name given for a whole table selects the table's kind."""
    value = rest.removeprefix("=").strip("\"' ")
    return (
        f".{TABLES[key]}={value}" if key in TABLES and rest.startswith("=") and value.isidentifier() else rest
    )


def _robot_near(key_path: str, raw: Table) -> tuple[str, str]:
    """The paths of the network and of the robot that a place is in, else of the first one; an index for one of many."""
    paths = []
    named = dict(re.findall(r"(network|robot)\[(\d+)\]", key_path))
    at: Any = raw
    for key in ("network", "robot"):
        entries = at.get(key) if isinstance(at, dict) else None
        entries = entries if isinstance(entries, list) else []
        index = int(named.get(key, 0))
        paths.append(f"{key}.{index}" if len(entries) > 1 else key)
        at = entries[index] if index < len(entries) else {}
    return paths[0], ".".join(paths)


def blamed(error: ScenarioError, settings: Sequence[Setting], raw: Table) -> ScenarioError:
    """The error, naming the setting that it concerns, or all settings if it concerns none of them.

    `raw`: the tables in which they were made.
    """
    if not settings:
        return error
    key_path = f"{error.place}"
    concerned = [setting for setting in settings if setting.concerns(key_path)]
    if not concerned:
        made = " ".join(setting.place for setting in settings)
        return ScenarioError(f"{error.path} with {made}", key_path, error.what, error.remedy)
    setting = concerned[-1]
    remedy = error.remedy
    if error.what == "unknown key" and _inside(setting.path, key_path):
        remedy = _deeper(key_path, setting, raw) or remedy
    key, _, value = setting.text.partition("=")
    tagged = _with_tag(key_path.rpartition(".")[2], f"={value}")
    if key_path == setting.path and error.what.startswith("expected a table") and tagged[0] == ".":
        remedy = f"write {_option(key + tagged, setting.option)}"
    if not remedy and error.what.startswith("expected a string"):
        remedy = f"to give text, write --set '{key}=\"..\"'"
    problem = error.what if key_path == setting.path else f"{key_path}: {error.what}"
    return ScenarioError(f"{error.path}", setting.place, problem, remedy)
