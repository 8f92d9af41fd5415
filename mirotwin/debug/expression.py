"""Expressions of the debugger: names, `.` `->` `[]` `*` `&`, arithmetic, comparisons, as C has them.

    age >= 110 && !heard     frame[2].left     *pointer     lm629.left.real_position - start     R7 == 0x3F     P1.0

An expression is read once into a function of a scope, which looks names up; so a condition costs little each time it
is asked. Numbers do not wrap. Nothing is ever written.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import msgspec

from miro_exact.bad_input import BadInput, shortened
from miro_robot.image.c_types import CType, Fields, value_of

_TOKEN = re.compile(
    r"\s*(?:(0[xX][0-9a-fA-F]+|[0-9]+)|(\w+:)?([A-Za-z_]\w*)|('(?:\\.|[^'\\])')|"
    r"(->|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^~!<>().\[\]]))"
)
_LEVELS: tuple[tuple[str, ...], ...] = (
    ("||",), ("&&",), ("|",), ("^",), ("&",), ("==", "!="), ("<", "<=", ">", ">="), ("<<", ">>"), ("+", "-"),
    ("*", "/", "%"),
)  # fmt: skip
_MOST_DEEP, _MOST_SHIFT = 64, 64
_ESCAPES = {"n": 10, "r": 13, "t": 9, "0": 0}
MEMORY_OF_POINTER = {"DC": "code", "DX": "xram", "DP": "xram", "DD": "iram", "DI": "iram"}
_GENERIC = {0x00: "xram", 0x40: "iram", 0x60: "xram", 0x80: "code"}
_BYTE = CType("int", 1)


class NoValue(BadInput):
    """An expression that cannot be read, or has no value here."""

    def __init__(self, what: str, remedy: str = "") -> None:
        super().__init__("", "", what, remedy)


class Value(msgspec.Struct, frozen=True):
    """Something an expression means. `kind`, `space`, `address`: of what lies in a memory; `number`: of what does not.

    `members`: of a group, functions by name. `note`: where it is, or why it may be stale.
    """

    kind: CType | None = None
    space: str = ""
    address: int = 0
    number: Any = None
    members: Mapping[str, Callable[[], Value]] | None = None
    fields: Fields = {}
    note: str = ""


class Scope(Protocol):
    """What names mean at a moment."""

    def find(self, name: str, module: str) -> Value:
        """Raises NoValue."""

    def read(self, space: str, address: int, count: int) -> bytes:
        """Bytes of a memory. Raises NoValue."""


Term = Callable[[Scope], Value]


def expression(text: str) -> Term:
    """What `text` means. Raises NoValue for what is no expression."""
    reader = _Reader(text)
    term = reader.binary(0)
    if reader.token:
        raise NoValue(f"{shortened(repr(text))} cannot be read from {shortened(repr(reader.token))} on")
    return term


def content(value: Value, scope: Scope) -> Any:
    """What it holds: int, float, bool, list, dict. Raises NoValue for a group."""
    if value.members is not None:
        return {name: content(get(), scope) for name, get in value.members.items()}
    if value.kind is None or value.number is not None:
        return value.number
    data = scope.read(value.space, value.address, value.kind.size)
    return value_of(value.kind, data, value.fields)


def number(value: Value, scope: Scope) -> Any:
    """The same of a single number; an array is its address."""
    if value.kind is not None and value.kind.kind == "array" and value.number is None:
        return value.address
    found = content(value, scope)
    if not isinstance(found, int | float):
        raise NoValue("is no single number", "name one of its members or elements")
    return found


def children(value: Value) -> list[tuple[str, Value]]:
    """Members and elements by name, empty for a single number."""
    kind = value.kind
    if value.members is not None:
        return [(name, get()) for name, get in value.members.items()]
    if kind is not None and kind.kind == "array":
        return [(f"[{at}]", _element(value, at)) for at in range(kind.count)]
    if kind is not None and kind.kind == "struct":
        return [(field.name, member(value, field.name)) for field in value.fields.get(kind.tag, ())]
    return []


def member(value: Value, name: str) -> Value:
    """A member of a struct or of a group, or a bit of a byte. Raises NoValue."""
    if value.members is not None:
        if name in value.members:
            return value.members[name]()
        raise NoValue(f"has no member {name}", f"it has {', '.join(value.members)}")
    kind = value.kind
    for field in value.fields.get(kind.tag, ()) if kind is not None and kind.kind == "struct" else ():
        if field.name == name:
            return msgspec.structs.replace(value, kind=field.type, address=value.address + field.offset)
    raise NoValue(f"has no member {name}")


def _element(value: Value, index: int) -> Value:
    kind = value.kind
    if kind is None or kind.kind != "array" or kind.element is None:
        raise NoValue("is no array")
    if not 0 <= index < kind.count:
        raise NoValue(f"[{index}] is outside of {kind}", f"give 0 to {kind.count - 1}")
    part = None if value.number is None else value.number[index]
    place = value.address + index * kind.element.size
    return msgspec.structs.replace(value, kind=kind.element, address=place, number=part)


def _pointed(value: Value, scope: Scope) -> Value:
    kind = value.kind
    if kind is not None and kind.kind == "array":
        return _element(value, 0)
    if kind is None or kind.kind != "pointer":
        raise NoValue("is no pointer", "name a memory: iram[0x30], xram[..], code[..]")
    address = number(value, scope)
    space = MEMORY_OF_POINTER.get(kind.tag) or _GENERIC.get(address >> 16, "")
    element = kind.element
    if element is not None and element.kind == "struct":
        size = max((one.offset + one.type.size for one in value.fields.get(element.tag, ())), default=0)
        element = msgspec.structs.replace(element, size=size)
    if not space or element is None or not element.size:
        raise NoValue(
            f"points to {address:#x}, and no debug file says to what", "name a memory: iram[..], xram[..]"
        )
    return Value(element, space, address & 0xFFFF, fields=value.fields)


def _divided(left: Any, right: Any) -> Any:
    if not right:
        raise NoValue("division by zero")
    if isinstance(left, float) or isinstance(right, float):
        return left / right
    return abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1)


def _shifted(left: int, right: int, way: Callable[[int, int], int]) -> int:
    if not 0 <= right <= _MOST_SHIFT:
        raise NoValue(f"a shift by {right}")
    return way(left, right)


_OPERATORS: dict[str, Callable[[Any, Any], Any]] = {
    "|": operator.or_, "^": operator.xor, "&": operator.and_, "==": operator.eq, "!=": operator.ne,
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
    "<<": lambda a, b: _shifted(a, b, operator.lshift), ">>": lambda a, b: _shifted(a, b, operator.rshift),
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": _divided,
    "%": lambda a, b: a - b * _divided(a, b),
}  # fmt: skip
_SIGNS: dict[str, Callable[[Any], Any]] = {
    "-": operator.neg,
    "~": operator.invert,
    "!": operator.not_,
    "+": operator.pos,
}


class _Reader:
    """Reads one expression, token by token."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = self.depth = 0
        self.next()

    def next(self) -> str:
        """Takes the token that is next, and looks at the one after it."""
        taken = getattr(self, "token", "")
        found = _TOKEN.match(self.text, self.at)
        if found is None and self.text[self.at :].strip():
            raise NoValue(
                f"{shortened(repr(self.text))} cannot be read from {shortened(repr(self.text[self.at :]))} on"
            )
        self.token = found[0].strip() if found else ""
        self.parts = found.groups() if found else (None,) * 5
        self.at = found.end() if found else len(self.text)
        return taken

    def expect(self, wanted: str) -> None:
        if self.token != wanted:
            raise NoValue(f"{shortened(repr(self.text))} lacks a {wanted}")
        self.next()

    def binary(self, level: int) -> Term:
        if level == len(_LEVELS):
            return self.unary()
        left = self.binary(level + 1)
        while self.token in _LEVELS[level]:
            left = _combined(self.next(), left, self.binary(level + 1))
        return left

    def unary(self) -> Term:
        self.depth += 1
        if self.depth > _MOST_DEEP:
            raise NoValue(f"{shortened(repr(self.text))} is nested too deeply")
        if self.token in (*_SIGNS, "*", "&"):
            sign = self.next()
            term = _signed(sign, self.unary())
        else:
            term = self.postfix(self.primary())
        self.depth -= 1
        return term

    def postfix(self, term: Term) -> Term:
        while self.token in (".", "->", "["):
            how = self.next()
            if how == "[":
                term = _indexed(term, self.binary(0))
                self.expect("]")
            else:
                term = _member_of(term, self.next(), how == "->")
        return term

    def primary(self) -> Term:
        digits, module, name, character, _ = self.parts
        if self.token == "(":
            self.next()
            term = self.binary(0)
            self.expect(")")
            return term
        if digits is None and name is None and character is None:
            raise NoValue(
                f"{shortened(repr(self.text))} lacks a name or a number"
                + (f" before {self.token}" if self.token else "")
            )
        self.next()
        if name is not None:
            where = (module or "").removesuffix(":")
            return lambda scope: scope.find(name, where)
        if digits is not None:
            constant = Value(number=int(digits, 16 if digits[:2].lower() == "0x" else 10))
        else:
            assert character is not None
            constant = Value(
                number=_ESCAPES.get(character[2], ord(character[2]))
                if "\\" in character
                else ord(character[1])
            )
        return lambda scope: constant


def _combined(how: str, left: Term, right: Term) -> Term:
    if how in ("&&", "||"):
        stops = how == "||"

        def both(scope: Scope) -> Value:
            if bool(number(left(scope), scope)) == stops:
                return Value(number=int(stops))
            return Value(number=int(bool(number(right(scope), scope))))

        return both
    apply = _OPERATORS[how]

    def combined(scope: Scope) -> Value:
        try:
            return Value(number=_plain(apply(number(left(scope), scope), number(right(scope), scope))))
        except TypeError:
            raise NoValue(f"{how} is for whole numbers") from None

    return combined


def _signed(sign: str, term: Term) -> Term:
    if sign == "*":
        return lambda scope: _pointed(term(scope), scope)
    if sign == "&":
        return lambda scope: _address(term(scope))
    apply = _SIGNS[sign]

    def signed(scope: Scope) -> Value:
        try:
            return Value(number=_plain(apply(number(term(scope), scope))))
        except TypeError:
            raise NoValue(f"{sign} is for whole numbers") from None

    return signed


def _plain(found: Any) -> Any:
    return int(found) if isinstance(found, bool) else found


def _address(value: Value) -> Value:
    if not value.space:
        raise NoValue("has no address")
    return Value(number=value.address, note=f"in {value.space}")


def _indexed(term: Term, index: Term) -> Term:
    def indexed(scope: Scope) -> Value:
        value, at = term(scope), number(index(scope), scope)
        if value.kind is not None and value.kind.kind == "pointer":
            first = _pointed(value, scope)
            assert first.kind is not None
            return msgspec.structs.replace(first, address=first.address + at * first.kind.size)
        return _element(value, at)

    return indexed


def _member_of(term: Term, name: str, through: bool) -> Term:
    def found(scope: Scope) -> Value:
        value = term(scope)
        if name.isdecimal():
            bits = number(value, scope)
            if not isinstance(bits, int) or int(name) > 31:
                raise NoValue(f"has no bit {name}")
            return Value(number=bits >> int(name) & 1)
        return member(_pointed(value, scope) if through else value, name)

    return found


def memory(space: str, size: int) -> Value:
    """A whole memory, as an array of bytes."""
    return Value(CType("array", size, element=_BYTE, count=size), space)
