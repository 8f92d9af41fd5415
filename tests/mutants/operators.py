"""What a mutant of a C file is: one small change, of kinds that were found to test tests as real mistakes do.

The set is that of Andrews, Briand and Labiche ("Is mutation an appropriate tool for testing experiments?", ICSE 2005,
doi 10.1145/1062455.1062530), made for C: an integer constant becomes 0, 1, -1, itself + 1 or - 1; an operator becomes
another one of its class; the decision of an `if` or `while` is negated; a statement is deleted. Added is the class of
shifts, since this firmware shifts more than it divides, and `true` and `false`, which are constants here. Deleted are
simple statements (a call, an assignment, `break`, `return`), no declarations and no blocks: a block is without effect
when its decision is negated.
"""

from typing import NamedTuple

from tests.mutants.c_tokens import words

CLASSES = {
    "relational": ("<", "<=", ">", ">=", "==", "!="),
    "arithmetic": ("+", "-", "*", "/", "%"),
    "shift": ("<<", ">>"),
    "bitwise": ("&", "|", "^"),
    "logical": ("&&", "||"),
    "step": ("++", "--"),
    "assignment": ("+=", "-=", "&=", "|=", "^="),
}
OPERATORS = ("constant", *CLASSES, "condition", "statement")
_CLASS_OF = {mark: name for name, marks in CLASSES.items() for mark in marks}
_TYPES = frozenset(("u8", "u16", "int", "unsigned", "signed", "char", "long", "short", "bool", "void"))
_HEADERS = frozenset(("if", "while", "for", "switch"))
_COMPOUND = _HEADERS | {"do", "else", "case", "default", "{", "}"}


class Change(NamedTuple):
    """`old`, which stands at `start`, becomes `new`; `operator` is one of OPERATORS, `form` names the change in it."""

    start: int
    old: str
    new: str
    operator: str
    form: str

    def applied(self, source):
        """The mutant's text."""
        assert source.startswith(self.old, self.start)
        return source[: self.start] + self.new + source[self.start + len(self.old) :]


def changes(source):
    """All changes of a text that can be made, in the order of their places."""
    found = words(source)
    every = [*_of_tokens(found), *_of_decisions(source, found), *_of_statements(source, found)]
    return sorted(every, key=lambda change: (change.start, OPERATORS.index(change.operator)))


def _of_tokens(found):
    for place, token in enumerate(found):
        if token.kind == "number":
            for new in _constants(token.text):
                yield Change(token.start, token.text, new, "constant", new.strip("()"))
        elif token.text in ("true", "false"):
            other = "false" if token.text == "true" else "true"
            yield Change(token.start, token.text, other, "constant", other)
        elif token.text in _CLASS_OF and (token.text in ("++", "--") or _is_binary(found, place)):
            operator = _CLASS_OF[token.text]
            for other in CLASSES[operator]:
                if other != token.text:
                    yield Change(token.start, token.text, other, operator, other)


def _constants(text):
    """Other values for a constant, written as it is written."""
    digits = text.rstrip("uUlL")
    suffix = text[len(digits) :]
    is_hex = digits[:2] in ("0x", "0X")
    value = int(digits, 16 if is_hex else 8 if digits[0] == "0" else 10)
    others = dict.fromkeys(other for other in (0, 1, -1, value + 1, value - 1) if other != value)
    form = f"0x{{:0{len(digits) - 2}X}}" if is_hex else "{}"
    return [f"(-1{suffix})" if other < 0 else form.format(other) + suffix for other in others]


def _is_binary(found, place):
    """Whether the mark there stands between two operands: before it ends one, and what ends is no cast."""
    before = found[place - 1] if place else None
    if before is None or before.macro != found[place].macro:
        return False
    if before.text == ")":
        opening = _opening(found, place - 1)
        return not all(token.text in _TYPES for token in found[opening + 1 : place - 1])
    return (before.kind in ("name", "number", "text") and before.text != "return") or before.text == "]"


def _opening(found, place):
    """Where the parenthesis opens that closes at `place`."""
    depth = 0
    for at in range(place, -1, -1):
        depth += {")": 1, "(": -1}.get(found[at].text, 0)
        if not depth:
            return at
    raise ValueError(f"a parenthesis closes at character {found[place].start} that was never opened")


def _closing(found, place):
    """Where the parenthesis closes that opens at `place`."""
    depth = 0
    for at in range(place, len(found)):
        depth += {"(": 1, ")": -1}.get(found[at].text, 0)
        if not depth:
            return at
    raise ValueError(f"the parenthesis at character {found[place].start} is never closed")


def _of_decisions(source, found):
    for place, token in enumerate(found):
        if token.text in ("if", "while") and found[place + 1].text == "(":
            begin, end = found[place + 1], found[_closing(found, place + 1)]
            old = source[begin.start : end.end]
            yield Change(begin.start, old, f"(!{old})", "condition", "not")


def _of_statements(source, found):
    code = [token for token in found if not token.macro and token.kind != "directive"]
    place = 0
    while place < len(code):
        if code[place].text == "{" and place and code[place - 1].text == ")":
            place = yield from _of_body(source, code, place)
        place += 1


def _of_body(source, code, place):
    """Statements of a function whose body opens at `place`; returns where it closes."""
    depth = 0
    while True:
        word = code[place].text
        if word in ("{", "}"):
            depth += 1 if word == "{" else -1
            if not depth:
                return place
            place += 1
        elif word in _HEADERS:
            place = _closing(code, place + 1) + 1
        elif word in ("case", "default"):
            while code[place].text != ":":
                place += 1
            place += 1
        elif word in _COMPOUND:
            place += 1
        else:
            begin = place
            while code[place].text != ";":
                place = _closing(code, place) + 1 if code[place].text == "(" else place + 1
            if place > begin and not _is_declaration(code[begin : begin + 2]):
                old = source[code[begin].start : code[place].end]
                yield Change(code[begin].start, old, ";", "statement", "delete")
            place += 1


def _is_declaration(two):
    return two[0].text not in ("return", "goto") and two[0].kind == two[1].kind == "name"
