"""Tables that are made from the code when the site is built: keys of scenarios, channels, figures of a campaign, rules,
and of files of rows.

<!-- keys: miro_sim.scenario.keys:Scenario -->      a section for each struct of keys
<!-- channels -->                                   one for each channel of a recording
<!-- figures -->                                    the columns of a results file
<!-- rules -->                                      the rules of `mirotwin conform`, in the folder of the documents
<!-- readings: miro_robot.lm629.options:Lm629Options -->   fields whose docstrings begin with the name of a rule
<!-- csv: tests/robot/ucsim/disagreements.csv -->   a file of the tree, whose cells are Markdown
"""

from __future__ import annotations

import ast
import csv
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
from msgspec import inspect as kinds

from docs.site import conformance_table

ROOT = Path(__file__).parents[2]

MARK = re.compile(
    r"^<!-- ((?P<kind>keys|readings): (?P<struct>[\w.]+:\w+)|channels|figures|rules|csv: (?P<csv>[\w./-]+)) -->$",
    re.MULTILINE,
)


def filled(markdown: str) -> str:
    """The text of a page with its tables."""
    return MARK.sub(_table, markdown)


def _table(found: re.Match[str]) -> str:
    if found["struct"]:
        module, _, name = found["struct"].partition(":")
        struct = getattr(import_module(module), name)
        return "\n".join(key_sections(struct) if found["kind"] == "keys" else reading_rows(struct))
    if found["csv"]:
        return "\n".join(csv_rows(ROOT / found["csv"]))
    if found[1] == "rules":
        return conformance_table.render()
    return "\n".join(channel_sections() if found[1] == "channels" else figure_rows())


def about(struct: type) -> str:
    """The docstring, without the signature that msgspec puts in where there is none."""
    text = inspect.getdoc(struct) or ""
    return "" if text.startswith(f"{struct.__name__}(") else text


# Keys


def key_sections(root: type) -> Iterator[str]:
    """Heading, docstring and table of a struct and of all that its keys hold, each once."""
    waiting, seen = [("", root)], set()
    while waiting:
        path, struct = waiting.pop(0)
        if struct in seen:
            continue
        seen.add(struct)
        config = struct.__struct_config__
        tag = f"{config.tag_field} = {config.tag!r}".replace("'", '"') if config.tag is not None else ""
        place = f"`[{path}]`" if path else "Top of the file"
        yield f"### {place}{f', `{tag}`' if tag else ''}\n\n{about(struct)}\n"
        yield "| key | value | default |\n|---|---|---|"
        for field in kinds.type_info(struct).fields:
            name = field.encode_name
            below = list(structs_in(field.type)) or parts_of(name)
            inside = f"{path}.{name}".lstrip(".")
            waiting += [(inside, one) for one in below]
            value = "table, below" if below else value_of(field.type)
            low, high = getattr(struct, "WITHIN", {}).get(name, (None, None))
            value += f" (>= {low:g}, <= {high:g})" if low is not None else ""
            yield f"| `{name}` | {value} | {default_of(field)} |"
        yield ""


def readings(struct: type) -> Iterator[tuple[str, str, str]]:
    """(rule, field, meaning) of the fields whose docstring is `RULE: MEANING`."""
    (tree,) = ast.parse(inspect.getsource(struct)).body
    assert isinstance(tree, ast.ClassDef)
    for field, text in pairwise(tree.body):
        if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
            assert isinstance(field.target, ast.Name)
            assert isinstance(text.value, ast.Constant)
            rule, _, meaning = " ".join(str(text.value.value).split()).partition(": ")
            yield rule, field.target.id, meaning


def reading_rows(struct: type) -> Iterator[str]:
    fields = {field.encode_name: field for field in kinds.type_info(struct).fields}
    yield "| rule | key | values | default | what |\n|---|---|---|---|---|"
    for rule, name, meaning in readings(struct):
        field = fields[name]
        yield f"| {rule} | `{name}` | {value_of(field.type)} | {default_of(field)} | {meaning} |"


def parts_of(key: str) -> list[type]:
    """The structs of our own laws, estimators and references, if it is the key that names one."""
    from miro_host.registries import ESTIMATORS, LAWS, REFERENCES

    registry: Any = {"controller": LAWS, "estimator": ESTIMATORS, "reference": REFERENCES}.get(key)
    return [registry.find(name) for name in registry.own] if registry is not None else []


def structs_in(kind: Any) -> Iterator[type]:
    """The structs of a table, of one of several kinds of table, or of an array of tables."""
    if isinstance(kind, kinds.Metadata):
        yield from structs_in(kind.type)
    elif isinstance(kind, kinds.StructType):
        yield kind.cls
    elif isinstance(kind, kinds.UnionType):
        for one in kind.types:
            yield from structs_in(one)
    elif isinstance(kind, kinds.VarTupleType | kinds.ListType):
        yield from structs_in(kind.item_type)


def value_of(kind: Any) -> str:
    """What a key may hold, in words."""
    if isinstance(kind, kinds.Metadata):
        return value_of(kind.type)
    if isinstance(kind, kinds.FloatType | kinds.IntType):
        name = "number" if isinstance(kind, kinds.FloatType) else "whole number"
        bounds = [(">= ", kind.ge), ("> ", kind.gt), ("<= ", kind.le), ("< ", kind.lt)]
        said = [f"{sign}{bound:g}" for sign, bound in bounds if bound is not None]
        return f"{name} ({', '.join(said)})" if said else name
    if isinstance(kind, kinds.LiteralType):
        return ", ".join(f"`{_toml(value)}`" for value in kind.values)
    if isinstance(kind, kinds.UnionType):
        return " or ".join(value_of(one) for one in kind.types if not isinstance(one, kinds.NoneType))
    simple = {
        kinds.BoolType: "`true`, `false`",
        kinds.StrType: "text",
        kinds.DictType: "table",
        kinds.VarTupleType: "array",
        kinds.ListType: "array",
        kinds.TupleType: "array",
        kinds.EnumType: "name",
        kinds.AnyType: "anything",
    }
    return simple.get(type(kind), type(kind).__name__)


def default_of(field: Any) -> str:
    if field.required:
        return "has to be given"
    value = field.default if field.default is not kinds.NODEFAULT else None
    if value is None or isinstance(value, msgspec.Struct | dict | tuple | list):
        return ""
    return f"`{_toml(value)}`"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else f"{value}"


# Channels and figures


def channel_sections() -> Iterator[str]:
    """Heading, docstring and fields of each channel."""
    from mirotwin.recording import channels

    for name, struct in {**channels.ROBOT_CHANNELS, **channels.OTHER_CHANNELS}.items():
        text = re.sub(rf"^`/?{re.escape(name)}`[^:]*: ", "", about(struct))
        yield f"### `{name}`\n\n{text[:1].upper() + text[1:]}\n"
        yield "| field | type |\n|---|---|"
        yield from (
            f"| `{field.encode_name}` | {json_type(field.type)} |" for field in kinds.type_info(struct).fields
        )
        yield ""


def json_type(kind: Any) -> str:
    """The type of a field in words of JSON."""
    if isinstance(kind, kinds.UnionType):
        return " or ".join(json_type(one) for one in kind.types)
    if isinstance(kind, kinds.StructType):
        inner = ", ".join(f"`{field.encode_name}`" for field in kinds.type_info(kind.cls).fields)
        return f"object: {inner}"
    if isinstance(kind, kinds.VarTupleType):
        return f"array of {json_type(kind.item_type)}"
    words = {
        kinds.IntType: "integer",
        kinds.FloatType: "number",
        kinds.StrType: "text",
        kinds.BoolType: "true or false",
        kinds.DictType: "object: numbers by name",
        kinds.NoneType: "null",
        kinds.LiteralType: "text",
        kinds.BytesType: "text, Base64",
    }
    return words.get(type(kind), type(kind).__name__)


def figure_rows() -> Iterator[str]:
    """The columns of a results file that are figures."""
    from mirotwin.campaign.columns import FIGURES

    yield "| column | type |\n|---|---|"
    for name, kind in FIGURES.items():
        yield f"| `{name}` | {'true or false' if kind is bool else kind.__name__} |"


# Files of rows


def csv_rows(path: Path) -> Iterator[str]:
    """The lines of a table with the rows of a file, the first one its head."""
    with path.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    for row in (head, ["---"] * len(head), *rows):
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"
