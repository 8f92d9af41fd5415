"""The table of the debugger's verbs, from which parsing, help and completion come.

A verb may be shortened; gdb's words are its aliases. `r` before those that move goes backwards.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import PureWindowsPath as AnyPath
from typing import Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from miro_exact.bad_input import BadInput, did_you_mean
from miro_sim.world.conditions import CONDITIONS
from mirotwin.debug import looking, moving, stops
from mirotwin.debug.expression import children, expression
from mirotwin.debug.session import Session
from mirotwin.debug.shown import FORMS

Completes = Literal["", "places", "expressions", "conditions", "verbs", "infos"]


class Verb(NamedTuple):
    """`does` takes the session, the rest of the line and, if `has_form`, the letters after a slash. `completes`: the
    kind of names that complete its argument. `repeats`: an empty line repeats the verb.
    """

    name: str
    aliases: str
    takes: str
    says: str
    does: Callable[..., None]
    completes: Completes = ""
    has_form: bool = False
    repeats: bool = False
    more: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name, *self.aliases.split())


def _move(name: str, aliases: str, takes: str, says: str) -> Verb:
    return Verb(name, aliases, takes, says, partial(moving.move, name), repeats=True)


def _help(session: Session, rest: str) -> None:
    if not rest:
        for verb in VERBS:
            session.tell(f"{verb.name:11} {verb.says}")
        session.tell("`help VERB` says what it takes. Verbs may be shortened; gdb's words are understood.")
        return
    verb = named(rest)
    session.tell(f"{verb.name}{'/FORM' * verb.has_form} {verb.takes}".strip() + f": {verb.says}")
    for line in filter(None, (verb.more, f"also: {verb.aliases.replace(' ', ', ')}" if verb.aliases else "")):
        session.tell(line)
    if verb.repeats:
        session.tell("an empty line does it again")


def _quit(session: Session, rest: str) -> None:
    session.ended = True


_PLACE = "PLACE is FILE:LINE, LINE, FUNCTION, ADDRESS or *ADDRESS."
_FORMS = "FORM is one of gdb's letters: " + ", ".join(f"{letter} {name}" for letter, name in FORMS.items())
VERBS = (
    _move("continue", "c fg", "[N]", "to the next breakpoint, or the N-th time something stops"),
    _move("finish", "fin", "", "to the caller"),
    _move("next", "n", "[N]", "to the next line, over calls"),
    _move("step", "s", "[N]", "to the next line, into calls"),
    _move("stepi", "si", "[N]", "one instruction"),
    _move("nexti", "ni", "[N]", "one instruction, over calls"),
    _move("rcontinue", "rc reverse-continue", "[N]", "back to the breakpoint before"),
    _move("rfinish", "rfin reverse-finish", "", "back to the call"),
    _move("rnext", "rn reverse-next", "[N]", "back to the line before, over calls"),
    _move("rstep", "rs reverse-step", "[N]", "back to the line before, into calls"),
    _move("rstepi", "rsi reverse-stepi", "[N]", "back by one instruction"),
    _move("rnexti", "rni reverse-nexti", "[N]", "back by one instruction, over calls"),
    Verb("goto", "g", "TIME", "any moment of the run: 1.5s, 20ms, 48000t", moving.go_to),
    Verb("until", "u advance", "[PLACE|EXPR|CONDITION KEY=VALUE ..]", "on to a place, an event, or where EXPR is true",
         moving.until, "conditions", more="alone: to a later line of this function, or its caller. EXPR is looked at "
         f"every millisecond. {_PLACE} Conditions: {', '.join(CONDITIONS)}."),
    Verb("break", "b br", "[PLACE] [if EXPR]", "stop there; alone: list them",
         stops.add, "places", more=f"{_PLACE} `break if EXPR` is here."),
    Verb("tbreak", "tb", "PLACE [if EXPR]", "stop there once", partial(stops.add, once=True), "places", more=_PLACE),
    Verb("watch", "", "VAR [if EXPR]", "stop before an instruction that writes it", stops.watch, "expressions"),
    Verb("rwatch", "", "VAR [if EXPR]", "stop before an instruction that reads it",
         partial(stops.watch, access="read"), "expressions"),
    Verb("awatch", "", "VAR [if EXPR]", "stop before an instruction that reads or writes it",
         partial(stops.watch, access="readWrite"), "expressions"),
    Verb("delete", "d", "[NUMBER ..]", "take breakpoints away; alone: all", stops.delete),
    Verb("where", "bt backtrace", "[N]", "the functions under way, or the N innermost", looking.where),
    Verb("frame", "f", "[N]", "`print` then means the names of frame N", looking.select),
    Verb("up", "", "[N]", "to the caller's frame", partial(looking.select, step=1), repeats=True),
    Verb("down", "", "[N]", "to the called function's frame", partial(looking.select, step=-1), repeats=True),
    Verb("print", "p inspect", "EXPR", "variables, registers ($a, $r7), SFR bits, lm629.left, pins, iram[0x30], parts, "
         "nets", looking.show, "expressions", has_form=True, more=_FORMS),
    Verb("x", "", "[PLACE]", "memory or instructions: x/8i $pc, x/16xb iram[0x30], x/s text; alone: what follows",
         looking.examine, "expressions", has_form=True, repeats=True, more="PLACE is an expression: where it lies, or "
         "what a pointer points to. A number is of code with /i, else of internal RAM. FORM is how many, a letter, and "
         f"a size: b 1, h 2, w 4, g 8 bytes. {_FORMS}"),
    Verb("display", "", "[EXPR]", "print it at each stop, or what x shows: display/4i $pc",
         looking.display, "expressions", has_form=True, more=_FORMS),
    Verb("undisplay", "", "[NUMBER ..]", "no longer", looking.undisplay),
    Verb("list", "l", "[PLACE]", "the source around, or around PLACE; of an address the instructions",
         looking.source, "places", more=_PLACE),
    Verb("disassemble", "disas", "[PLACE]", "the instructions of a function, with its lines",
         looking.function, "places", more=_PLACE),
    Verb("info", "i", "|".join(looking.INFO), "what there is of these", looking.info, "infos"),
    Verb("who", "", "VAR", "its last writer before now, with the functions under way there",
         looking.who, "expressions"),
    Verb("help", "h ?", "[VERB]", "this list, or what VERB takes", _help, "verbs"),
    Verb("quit", "q exit", "", "leave", _quit),
)  # fmt: skip
"""All verbs; an ambiguous beginning means the first one in this order."""
_BY_NAME = {name: verb for verb in VERBS for name in verb.names}
_COMMAND = re.compile(r"(?:r\s+(?=[a-z]))?[A-Za-z?][A-Za-z-]*")
_NOT_OF_A_RUN = ("set", "call", "jump", "return", "load", "kill")
_BEGUN_PATH = re.compile(r"((?:\w+:)?\$?\w+(?:(?:\.|->)\w+|\[\w+\])*)(?:\.|->)(\w*)$")
_BEGUN_STATIC = re.compile(r"\b([A-Za-z_]\w*):(\w*)$")
_BEGUN_WORD = re.compile(r"[\w.]*$")


def named(word: str) -> Verb:
    """The verb of a name, an alias, or the beginning of one. Raises BadInput."""
    verb = _BY_NAME.get(word) or next(
        (candidate for candidate in VERBS if candidate.name.startswith(word)), None
    )
    verb = verb or next((_BY_NAME[name] for name in _BY_NAME if name.startswith(word)), None)
    if verb is None:
        remedy = "nothing can be changed here: that would be another run" if word in _NOT_OF_A_RUN else ""
        remedy = remedy or did_you_mean(word, _BY_NAME, "`help` lists them")
        raise BadInput("", word, "is no command", remedy)
    return verb


def is_command(line: str, variables: Any) -> bool:
    """True if a line that may be an expression as well is a command: its verb is written in full, or an alias which is
    no name of the program.
    """
    begun = _COMMAND.match(line.strip())
    word = "".join(begun[0].split()) if begun else ""
    whole = line.strip()[begun.end() :] if begun else ""
    if word not in _BY_NAME or whole[:1] not in ("", " ", "/"):
        return False
    return _BY_NAME[word].name == word != "x" or (word not in variables and (len(word) > 1 or bool(whole)))


def do(session: Session, line: str) -> Verb | None:
    """Runs one line; the output is in the session. Returns None for an empty line. Raises BadInput."""
    session.lines.clear()
    session.why = ""
    line = line.strip()
    if not line:
        return None
    begun = _COMMAND.match(line)
    if begun is None:
        raise BadInput("", line.split()[0], "is no command", "`help` lists them; `print EXPR` shows a value")
    verb, rest = named("".join(begun[0].split())), line[begun.end() :].strip()
    form = ""
    if verb.has_form and rest[:1] == "/":
        form, _, rest = rest[1:].partition(" ")
    if not rest.strip() and verb.takes[:1].isupper():
        needed = verb.takes.split()[0]
        raise BadInput("", verb.name, f"lacks {needed}", f"write {verb.name} {verb.takes}")
    more = (form,) if verb.has_form else ()
    verb.does(session, rest.strip(), *more)
    return verb


def completions(session: Session, line: str) -> tuple[int, list[str]]:
    """Index at which the last word of a line begins, and its completions."""
    begun = _COMMAND.match(line)
    if begun is None or begun.end() == len(line):
        word = line.split(" ")[-1]
        return len(line) - len(word), sorted(
            name for name in _BY_NAME if name.startswith(word) and len(name) > 2
        )
    try:
        kind = named("".join(begun[0].split())).completes
    except BadInput:
        return len(line), []
    if " if " in line:
        kind = "expressions"
    if kind in ("", "verbs", "infos"):
        word = line.split(" ")[-1]
        there = {"verbs": [verb.name for verb in VERBS], "infos": [*looking.INFO]}.get(kind, [])
        return len(line) - len(word), sorted(name for name in there if name.startswith(word))
    if kind == "conditions" and (words := _keys(line[begun.end() :])) is not None:
        word = re.split(r"[\s=]", line)[-1]
        return len(line) - len(word), sorted(candidate for candidate in words if candidate.startswith(word))
    return _names(session, line, kind)


def _names(session: Session, line: str, kind: Completes) -> tuple[int, list[str]]:
    if path := _BEGUN_PATH.search(line):
        with suppress(BadInput):
            there = [name for name, _ in children(expression(path[1])(session.moment()))]
            return path.start(2), [name for name in there if name.startswith(path[2])]
    if static := _BEGUN_STATIC.search(line):
        there = sorted(
            name
            for name, variables in session.symbols.variables.by_name.items()
            if any(static[1] in (variable.module, variable.scope) for variable in variables)
        )
        return static.start(2), [name for name in there if name.startswith(static[2])]
    begun = _BEGUN_WORD.search(line)
    word = begun[0] if begun else ""
    names = set(session.symbols.known)
    if kind == "places":
        names |= {f"{AnyPath(variable.file).name}:" for variable in session.symbols.line_begins.values()}
    if kind == "conditions":
        names |= set(CONDITIONS)
    return len(line) - len(word), sorted(name for name in names if name.startswith(word))


def _keys(given: str) -> list[str] | None:
    """Keys of a condition, or the values of one that has a few; None where no condition is named."""
    name, *keys = given.split() + [""] * given.endswith(" ") or [""]
    kind = CONDITIONS.get(name)
    if kind is None or not keys:
        return None
    hints = {key: hint for key, hint in get_type_hints(kind).items() if key in kind.__struct_fields__}
    key, has_value, _ = keys[-1].partition("=")
    if has_value:
        return [str(value) for value in _literals(hints.get(key))]
    return [f"{key}=" for key in hints]


def _literals(hint: Any) -> tuple[Any, ...]:
    if get_origin(hint) is Literal:
        return get_args(hint)
    return tuple(value for part in get_args(hint) for value in _literals(part))
