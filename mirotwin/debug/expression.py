"""Expressions of the debugger: names, `.` `->` `[]` `*` `&`, arithmetic and comparisons as in C.

    age >= 110 && !heard     frame[2].left     *pointer     lm629.left.real_position - start     R7 == 0x3F     P1.0
    eyes.distance_cm < 30    lcd.text == "READY"    $sp > 0x60

An expression is compiled once into a function of a moment, which looks names up, so evaluating a condition is cheap.
Numbers do not wrap. Nothing is ever written.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, Protocol

import msgspec

from miro_exact.bad_input import BadInput, did_you_mean, shortened
from miro_robot.image.c_types import CType, Fields, value_of
from miro_robot.mcs51.opcodes import BITS, SFRS

_TOKEN = re.compile(
    r"""\d+\.\d+|\$\w+|(?:[A-Za-z_]\w*:)?\w+|'(?:\\.|[^'\\])'|"(?:\\.|[^"\\])*"|->|<<|>>|[<>=!]=|&&|\|\||\S"""
)
_MOST_CHARACTERS, _MOST_TOKENS, _MOST_SHIFT, _MOST_DIGITS = 4096, 128, 64, 80
_LEVELS = ("||", "&&", "|", "^", "&", "== !=", "< <= > >=", "<< >>", "+ -", "* / %")
_RANKS = {sign: rank for rank, signs in enumerate(_LEVELS) for sign in signs.split()}
REGISTERS = (*(f"R{at}" for at in range(8)), "A", "B", "DPTR", "SP", "PSW", "PC")
_ESCAPES = {"n": 10, "r": 13, "t": 9, "0": 0}
MEMORY_OF_POINTER = {"DC": "code", "DX": "xram", "DP": "xram", "DD": "iram", "DI": "iram"}
_GENERIC = {0x00: "xram", 0x40: "iram", 0x60: "xram", 0x80: "code"}


class NoValue(BadInput):
    """An expression that cannot be read, or has no value here."""

    def __init__(self, reason: str, remedy: str = "") -> None:
        super().__init__("", "", reason, remedy)


class Lookup(Protocol):
    """The environment of an expression: a processor at a moment of the run (`symbols.Moment`)."""

    def find(self, name: str, module: str) -> Value:
        """The meaning of a name; `module`: the file that is named before it. Raises NoValue."""

    def read(self, space: str, address: int, count: int) -> bytes:
        """Bytes of a memory. Raises BadInput for one that is not there."""


class Value(msgspec.Struct, frozen=True):
    """The value of an expression. `kind`, `space`, `address`: type and place, for a value in a memory of `moment`.

    `number`: for a value without a place. `members`: of a group, functions by name. `note`: its place, or why it may be
    stale.
    """

    kind: CType | None = None
    space: str = ""
    address: int = 0
    moment: Lookup | None = None
    number: Any = None
    members: Mapping[str, Callable[[], Value]] | None = None
    fields: Fields = {}
    note: str = ""


Term = Callable[[Lookup], Value]
_ZERO = Value(number=0)


def expression(text: str, known: Collection[str] = ()) -> Term:
    """Compiles `text`. Raises NoValue for a syntax error, and for names not in `known`, if `known` is not empty."""
    reader = _Reader(text, known)
    term = reader.binary(0)
    if reader.token:
        raise reader.refused(f"cannot be read from {reader.token!r} on")
    return term


def names_in(text: str) -> list[tuple[str, str]]:
    """(module or "", name) of each name in an expression."""
    tokens = _TOKEN.findall(text)
    pairs = [(token.rpartition(":"), before) for token, before in zip(tokens, ["", *tokens], strict=False)]
    return [
        (word[0], word[2]) for word, before in pairs if word[2].isidentifier() and before not in (".", "->")
    ]


def content(value: Value) -> Any:
    """The content of a value: int, float, bool, list or dict.

    Raises BadInput for bytes of a memory that does not exist.
    """
    if value.members is not None:
        return {name: content(get()) for name, get in value.members.items()}
    if value.moment is None or value.kind is None:
        return value.number
    return value_of(value.kind, value.moment.read(value.space, value.address, value.kind.size), value.fields)


def operand(value: Value) -> Any:
    """The value as a single number or a text; of an array its address. Raises NoValue."""
    return value.number if isinstance(value.number, str) else number(value)


def number(value: Value) -> Any:
    """The value as a single number; of an array its address. Raises NoValue."""
    if value.kind is not None and value.kind.kind == "array":
        return value.address
    result = content(value)
    if isinstance(result, str):
        raise NoValue("is a text", 'compare it with one: == "READY"')
    if not isinstance(result, int | float):
        raise NoValue("is no single number", "name one of its members or elements")
    return result


def children(value: Value) -> list[tuple[str, Callable[[], Value]]]:
    """Members and elements by name, empty for a single number; of a special function register its bits."""
    kind = value.kind
    if value.members is not None or kind is None:
        return list((value.members or {}).items())
    if value.space == "sfr" and kind.size == 1:
        bits = [(name, bit) for name, bit in BITS.items() if bit & 0xF8 == value.address]
        return [(name, partial(Value, CType("bit", 1), "bit", bit, value.moment)) for name, bit in bits]
    if kind.kind == "array":
        return [(f"[{at}]", partial(_element, value, at)) for at in range(kind.count)]
    fields = value.fields.get(kind.tag, ()) if kind.kind == "struct" else ()
    return [(field.name, partial(_part, value, field.type, field.offset)) for field in fields]


def _part(value: Value, kind: CType, offset: int) -> Value:
    return msgspec.structs.replace(value, kind=kind, address=value.address + offset)


def _with_members(value: Value, moment: Lookup, text: str) -> Value:
    """Of a name that both the program and a part of the board have: the part, where only that has members."""
    if value.members is not None or children(value):
        return value
    try:
        parts = moment.find("parts", "").members or {}
    except NoValue:
        return value
    return parts[text]() if text in parts else value


def _member(value: Value, name: str, text: str) -> Value:
    there = {} if value.kind is not None and value.kind.kind == "array" else dict(children(value))
    if name not in there:
        raise NoValue(f"{text} has no member {name}", f"it has {', '.join(there)}" if there else "")
    return there[name]()


def _element(value: Value, index: int, text: str = "") -> Value:
    kind = value.kind
    if kind is None or kind.element is None or kind.kind != "array":
        raise NoValue(f"{text} is no array and no pointer")
    if not 0 <= index < kind.count:
        raise NoValue(f"[{index}] is outside of {kind}", f"give 0 to {kind.count - 1}")
    return _part(value, kind.element, index * kind.element.size)


def pointed(value: Value, index: Any, text: str) -> Value:
    """The element at `index` behind a pointer, or of an array. `text` is for errors."""
    if not isinstance(index, int):
        raise NoValue(f"[{index}] is no whole number")
    kind = value.kind
    if kind is None or kind.kind != "pointer":
        return _element(value, index, text)
    address = number(value)
    space = MEMORY_OF_POINTER.get(kind.tag) or _GENERIC.get(address >> 16, "")
    element = kind.element
    if element is not None and element.kind == "struct":
        size = max((field.offset + field.type.size for field in value.fields.get(element.tag, ())), default=0)
        element = msgspec.structs.replace(element, size=size)
    if not space or element is None or not element.size:
        raise NoValue(
            f"points to {address:#x}, and no debug file says to what", "name a memory: iram[..], xram[..]"
        )
    return Value(element, space, (address & 0xFFFF) + index * element.size, value.moment, fields=value.fields)


def _divided(left: Any, right: Any) -> Any:
    if not right:
        raise NoValue("division by zero")
    if isinstance(left, float) or isinstance(right, float):
        return left / right
    return abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1)


def _shifted(way: Callable[[int, int], int], left: int, right: int) -> int:
    if not 0 <= right <= _MOST_SHIFT:
        raise NoValue(f"a shift by {right}")
    return way(left, right)


_OPERATORS: dict[str, Callable[..., Any]] = {
    "|": operator.or_, "^": operator.xor, "&": operator.and_, "==": operator.eq, "!=": operator.ne,
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
    "<<": lambda a, b: _shifted(operator.lshift, a, b), ">>": lambda a, b: _shifted(operator.rshift, a, b),
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": _divided,
    "%": lambda a, b: a - b * _divided(a, b),
}  # fmt: skip
_SIGNS: dict[str, Callable[..., Any]] = {
    "-": operator.neg, "~": operator.invert, "!": operator.not_, "+": operator.pos,
}  # fmt: skip


def _applied(apply: Callable[..., Any], sign: str, *terms: Term) -> Term:
    """A term that applies an operator to its operands."""

    read = operand if sign in ("==", "!=") else number

    def applied(moment: Lookup) -> Value:
        try:
            operands = [read(term(moment)) for term in terms]
            if read is operand and len({isinstance(value, str) for value in operands}) > 1:
                raise NoValue(f"{sign} compares a text and a number")
            result = apply(*operands)
            float(result)  # so that numbers do not grow without end
        except TypeError:
            raise NoValue(f"{sign} is for whole numbers") from None
        except OverflowError:
            raise NoValue(f"what {sign} gives is too large") from None
        return Value(number=int(result) if isinstance(result, bool) else result)

    return applied


def _either(stops: bool, left: Term, right: Term) -> Term:
    """`||` (`stops`: a true left side decides) and `&&`."""

    def either(moment: Lookup) -> Value:
        truth = bool(number(left(moment)))
        return Value(number=int(truth if truth == stops else bool(number(right(moment)))))

    return either


def _address(value: Value) -> Value:
    if not value.space:
        raise NoValue("has no address")
    return Value(number=value.address, space=value.space, note=f"in {value.space}")


class _Reader:
    """Reads one expression, token by token."""

    def __init__(self, text: str, known: Collection[str]) -> None:
        self.text = text
        self.known = known
        self.taken: list[str] = []
        self.tokens = _TOKEN.findall(text[:_MOST_CHARACTERS])
        if len(self.tokens) > _MOST_TOKENS or len(text) > _MOST_CHARACTERS:
            raise self.refused("is too long")

    def refused(self, reason: str) -> NoValue:
        return NoValue(f"{shortened(repr(self.text))} {reason}")

    @property
    def token(self) -> str:
        """The next token, "" at the end."""
        return self.tokens[0] if self.tokens else ""

    def take(self) -> str:
        taken = self.token
        del self.tokens[:1]
        self.taken.append(taken)
        return taken

    def expect(self, wanted: str) -> None:
        if self.take() != wanted:
            raise self.refused(f"lacks a {wanted}")

    def binary(self, rank: int) -> Term:
        left = self.unary()
        while _RANKS.get(self.token, -1) >= rank:
            sign = self.take()
            right = self.binary(_RANKS[sign] + 1)
            if sign in ("||", "&&"):
                left = _either(sign == "||", left, right)
            else:
                left = _applied(_OPERATORS[sign], sign, left, right)
        return left

    def unary(self) -> Term:
        sign, first = self.token, len(self.taken)
        if sign not in (*_SIGNS, "*", "&"):
            return self.postfix(self.primary(), first)
        self.take()
        term = self.unary()
        if sign == "*":
            return _indexed(term, lambda moment: _ZERO, "".join(self.taken[first + 1 :]))
        if sign == "&":
            return lambda moment: _address(term(moment))
        return _applied(_SIGNS[sign], sign, term)

    def postfix(self, term: Term, first: int) -> Term:
        """Parses the postfix operators after `term`; the text of `term` begins with token number `first`."""
        while self.token in (".", "->", "["):
            text = "".join(self.taken[first:])
            how = self.take()
            if how == "[":
                term = _indexed(term, self.binary(0), text)
                self.expect("]")
            else:
                target = _indexed(term, lambda moment: _ZERO, text) if how == "->" else term
                name = self.take()
                if not name.isidentifier() and not name.isdecimal():
                    raise self.refused("lacks the name of a member")
                term = _member_of(target, name, text)
        return term

    def primary(self) -> Term:
        token = self.take()
        if token == "(":
            term = self.binary(0)
            self.expect(")")
            return term
        module, _, name = token.rpartition(":")
        if name.isidentifier():
            if self.known and name not in self.known:
                raise NoValue(f"there is no {name}", did_you_mean(name, self.known))
            return lambda moment: moment.find(name, module)
        if token[:1] == "$" and len(token) > 1:
            return self.register(token)
        constant = Value(number=_text(token) if token[:1] == '"' and len(token) > 1 else _constant(token))
        if constant.number is None:
            raise self.refused(f"lacks a name or a number{f' before {token}' if token else ''}")
        return lambda moment: constant

    def register(self, token: str) -> Term:
        """`$sp`, `$r7`: as gdb has them, the number in a register."""
        name = token[1:].upper()
        known = (*REGISTERS, *SFRS)
        if name not in known:
            raise NoValue(f"{token} is no register", did_you_mean(name, known))

        def value(moment: Lookup) -> Value:
            held = moment.find(name, "")
            return Value(number=number(held), space="code" if name == "PC" else "")

        return value


def _text(token: str) -> str:
    """The text between the quotes."""
    escaped = re.compile(r"\\(.)", re.DOTALL)
    return escaped.sub(lambda match: chr(_ESCAPES.get(match[1], ord(match[1]))), token[1:-1])


def _constant(token: str) -> int | float | None:
    """Of digits or a character."""
    if len(token) > 2 and token[0] == "'":
        return _ESCAPES.get(token[2], ord(token[2])) if token[1] == "\\" else ord(token[1])
    with suppress(ValueError):
        if len(token) > _MOST_DIGITS:
            return None
        return float(token) if "." in token else int(token, 16 if token[:2].lower() == "0x" else 10)
    return None


def _indexed(term: Term, index: Term, text: str) -> Term:
    return lambda moment: pointed(term(moment), number(index(moment)), text)


def _member_of(term: Term, name: str, text: str) -> Term:
    """A member, or by a number a bit. `text` is the term's own."""
    if not name.isdecimal():
        return lambda moment: _member(_with_members(term(moment), moment, text), name, text)
    index = int(name[:9])

    def bit(moment: Lookup) -> Value:
        value = term(moment)
        if value.members is not None:  # a net of a latch: CTRL.0
            return _member(value, name, text)
        bits = 32 if value.kind is None else 1 if value.kind.kind == "bit" else 8 * value.kind.size
        if index >= bits:
            raise NoValue(f"{text} has no bit {shortened(name)}", f"give 0 to {bits - 1}")
        if value.moment is not None and value.kind is not None and value.kind.kind == "int":
            kind = CType("bits", value.kind.size, first_bit=index, bits=1)
            return msgspec.structs.replace(value, kind=kind, note=value.note if value.space == "sfr" else "")
        return number_of(lambda moment: value)(moment)

    number_of = partial(_applied, lambda word: word >> index & 1, f".{name}")
    return bit
