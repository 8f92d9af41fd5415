"""The variables of an image, with their C types: what the `.cdb` beside it says.

    last_left            a global, or a static of any one file
    failsafe:age         .. of this file, where several have one; `foo:count` a static of this function
    body[3]  pt.x        an element, a member

A variable that the compiler keeps in registers or on the stack has no place and is not found.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache

import msgspec

from miro_exact.bad_input import BadInput, did_you_mean
from miro_robot.image.c_types import MOST_BYTES, CType, Member, type_named, type_of, values_in
from miro_robot.image.debug_info import listings
from miro_robot.image.hex import Image
from miro_robot.image.symbol_files import CDB_SPACES, parse_bits, read_text

_KEPT = 32
# Numbers have at most as many digits as SDCC writes, with some to spare: a longer one is damage, and no record.
_TYPE = r"\(\{([0-9]{1,6})\}([^():]*):([SU])\)"
_SYMBOL = re.compile(r"^S:(G|F\w+|L[\w.]+)\$(\w+)\$(\w+\$\w+)" + _TYPE + r",([A-Z]),")
_PLACE = re.compile(r"^L:(G|F\w+|L[\w.]+)\$(\w+)\$(\w+\$\w+):([0-9A-F]{1,8})$")
_STRUCT = re.compile(r"^T:F(\w+?)\$(\w+)\[(.*)\]$")
_MEMBER = re.compile(r"\(\{([0-9]{1,6})\}S:S\$(\w+)\$\w+\$\w+" + _TYPE + r",")
_STEP = re.compile(r"\.(\w+)|\[([0-9]{1,6})\]")
_NAME = re.compile(r"(?:(\w+)(?:\.c)?:)?(\w+)((?:\.\w+|\[[0-9]{1,6}\])*)")


class Variable(msgspec.Struct, frozen=True):
    """`scope`: the file or function that it belongs to, "" for a global; `space` as of a `Symbol`; `module`: the file
    whose structs its type means; `local`: the scope is a function.
    """

    name: str
    scope: str
    address: int
    space: str
    type: CType
    module: str
    local: bool = False


class Variables(msgspec.Struct, frozen=True, eq=False):
    """The variables of one debug file. `structs`: members by module and tag.

    `unplaced`: bits, whose addresses are not in that file.
    """

    by_name: dict[str, tuple[Variable, ...]]
    structs: dict[str, dict[str, tuple[Member, ...]]]
    unplaced: tuple[Variable, ...] = ()

    def fields(self, variable: Variable) -> dict[str, tuple[Member, ...]]:
        """The structs that the variable's type may mean."""
        return self.structs.get(variable.module, {})


@lru_cache(_KEPT)
def parse_variables(text: str) -> Variables:
    """Parses the variables of a debug file; damaged records and records of unknown types are left out."""
    declared: dict[tuple[str, str, str], tuple[CType, str, str]] = {}
    structs: dict[str, dict[str, tuple[Member, ...]]] = {}
    scopes: dict[str, dict[str, Variable]] = {}
    module = ""
    for line in text.splitlines():
        if line.startswith("M:"):
            module = line[2:]
        elif line.startswith("T:") and (record := _STRUCT.match(line)):
            structs.setdefault(record[1], {})[record[2]] = tuple(_members(record[3]))
        elif line.startswith("S:") and (symbol := _SYMBOL.match(line)):
            kind = type_of(symbol[5], int(symbol[4]), symbol[6] == "S")
            if kind is not None and kind.kind not in ("function", "void") and symbol[7] in CDB_SPACES:
                declared.setdefault((symbol[1], symbol[2], symbol[3]), (kind, CDB_SPACES[symbol[7]], module))
        elif line.startswith("L:") and (record := _PLACE.match(line)):
            known = declared.get((record[1], record[2], record[3]))
            address = int(record[4], 16)
            if known is not None and address < MOST_BYTES:  # beyond any memory is damage
                kind, space, where = known
                scope = _scope(record[1])
                local = record[1][0] == "L"
                variable = Variable(record[2], scope, address, space, kind, where, local)
                scopes.setdefault(record[2], {})[scope] = variable
    bits = {
        (name, _scope(where)): Variable(name, _scope(where), -1, space, kind, module)
        for (where, name, _), (kind, space, module) in declared.items()
        if space == "bit" and _scope(where) not in scopes.get(name, {})
    }
    by_name = {}
    for name, each in scopes.items():
        sound = [
            variable_
            for variable_ in each.values()
            if values_in(variable_.type, structs.get(variable_.module, {}))
        ]
        if sound:
            by_name[name] = tuple(sound)
    return Variables(by_name, structs, tuple(bits.values()))


def _scope(record: str) -> str:
    """`G`, `Ffile` and `Lfile.function`: nothing, the file, the function."""
    return "" if record == "G" else record[1:].rpartition(".")[2]


def _members(text: str) -> Iterable[Member]:
    for member in _MEMBER.finditer(text):
        kind = type_of(member[4], int(member[3]), member[5] == "S")
        if kind is not None:
            yield Member(member[2], int(member[1]), kind)


def variables_of(image: Image) -> Variables:
    """The variables from the `.cdb` beside an image; empty without that file.

    Raises ImageError if it is another image's. The addresses of bits are taken from the instructions in the listings.
    """
    _ = image.symbols.names  # compares the files with the image
    parsed = parse_variables(read_text(image.path.with_suffix(".cdb")))
    if not parsed.unplaced:
        return parsed
    link_map = read_text(image.path.with_suffix(".map"))
    texts = {path.stem: read_text(path) for path in listings(image.path, link_map)}
    by_name = dict(parsed.by_name)
    for bit in parsed.unplaced:
        own = [texts[bit.module]] if bit.scope and bit.module in texts else list(texts.values())
        places = {address for text in own for address in parse_bits(text).get(f"_{bit.name}", ())}
        if len(places) == 1:
            placed = msgspec.structs.replace(bit, address=places.pop())
            by_name[bit.name] = (*by_name.get(bit.name, ()), placed)
    return msgspec.structs.replace(parsed, by_name=by_name, unplaced=())


def find_variable(image: Image, name: str, as_type: str = "") -> tuple[Variable, Variables]:
    """The variable, element or member that `name` means. `as_type` replaces its type, or gives one to a name that only
    the linker knows: `int16`, `uint8[4]`, `float`, `bit`. Raises BadInput with what comes close.
    """
    variables = variables_of(image)
    parts = _NAME.fullmatch(name)
    if parts is None:
        raise BadInput(
            image.path, name, "is no name of a variable", "write name, file:name, name[2] or name.x"
        )
    scope, plain, steps = parts[1] or "", parts[2], parts[3]
    variable = _named(image, variables, scope, plain, as_type)
    for step in _STEP.finditer(steps):
        variable = _inside(image, variables, name, variable, step[1], step[2])
    if as_type:
        kind = type_named(as_type)
        if kind is None:
            raise BadInput(
                image.path, name, f"{as_type!r} is no type", "give int16, uint8[4], float, bit, .."
            )
        variable = msgspec.structs.replace(variable, type=kind)
    return variable, variables


def _named(image: Image, variables: Variables, scope: str, plain: str, as_type: str) -> Variable:
    there = variables.by_name.get(plain) or variables.by_name.get(plain.removeprefix("_"), ())
    fitting = [variable for variable in there if not scope or scope in (variable.scope, variable.module)]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        choices = ", ".join(f"{variable.scope or variable.module}:{plain}" for variable in fitting)
        raise BadInput(image.path, plain, "there are several of this name", f"give one of {choices}")
    symbol = image.symbols.find(plain)
    if symbol is not None and symbol.space != "code" and as_type and not scope:
        return Variable(plain, "", symbol.address, symbol.space, CType("int", 1), "")
    if symbol is not None and symbol.space != "code":
        remedy = "build with --debug, or give it: read(name, 'int16')"
        raise BadInput(image.path, plain, "no .cdb beside the image says its type", remedy)
    if symbol is not None and not there:
        raise BadInput(image.path, plain, "is code, no variable", "give a variable's name")
    known = variables.by_name.items()
    names = [name for name, each in known if each[0].scope or each[0].space not in ("sfr", "bit")]
    names += [name.removeprefix("_") for name, each in image.symbols.names.items() if each.space == "iram"]
    near = did_you_mean(plain, names) or did_you_mean(plain, variables.by_name)
    remedy = near or "its .map and .cdb list the names"
    where = f"{scope}:{plain}" if scope else plain
    raise BadInput(image.path, where, "there is no such variable", remedy)


def _inside(
    image: Image, variables: Variables, name: str, variable: Variable, member: str | None, index: str | None
) -> Variable:
    """A member or an element of a variable."""
    kind = variable.type
    if member is not None:
        fields = variables.fields(variable).get(kind.tag, ()) if kind.kind == "struct" else ()
        for field in fields:
            if field.name == member:
                return msgspec.structs.replace(
                    variable, address=variable.address + field.offset, type=field.type
                )
        has = f"; it has {', '.join(field.name for field in fields)}" if fields else ""
        raise BadInput(image.path, name, f"{kind} has no member {member}{has}")
    at = int(index or 0)
    if kind.kind != "array" or kind.element is None:
        raise BadInput(image.path, name, f"{kind} is no array")
    if at >= kind.count:
        raise BadInput(image.path, name, f"{at} is after the end of {kind}", f"give 0 to {kind.count - 1}")
    return msgspec.structs.replace(
        variable, address=variable.address + at * kind.element.size, type=kind.element
    )
