"""The verbs that show the stack, values, memory, instructions and the source. They do not move in the run."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from copy import copy
from itertools import count

from miro_exact.bad_input import BadInput, amount
from miro_robot.image.symbol_files import read_text
from miro_robot.inspect.frames import RESET_SP, StackFrame
from miro_robot.mcs51.opcodes import LENGTH, SFRS, disassemble
from mirotwin.debug.expression import REGISTERS, NoValue, Value, expression, number, pointed
from mirotwin.debug.session import Examined, Session
from mirotwin.debug.shown import FORMS, in_form, lines_of, quoted, shown, text_at
from mirotwin.debug.stops import tell_all
from mirotwin.debug.symbols import SIZES

LINES_AROUND = 5
SHOWN_REGISTERS = (*REGISTERS, "tick", "cycle")
"""The registers that `info registers` shows."""
_UNITS = {"b": 1, "h": 2, "w": 4, "g": 8}
_EXAMINE = re.compile(r"([0-9]{0,5})([a-z]{0,2})")
_ROW_BYTES = {1: 8, 2: 16, 4: 16, 8: 16}

# The stack


def where(session: Session, rest: str) -> None:
    """Prints the active functions; N: the innermost N only.

    If the stack is out of step, also the surplus or missing bytes.
    """
    unwinder, cpu = session.symbols.unwinder, session.debugger.cpu
    first, _ = session.symbols.image.symbols.stack
    odd = unwinder.out_of_step(cpu, first - 1)
    frames = unwinder.frames(cpu, *(odd or ()))
    if rest and not (rest.isdecimal() and int(rest[:9]) > 0):
        raise BadInput("", "where", f"{rest} is no number of frames")
    show_frames(session, frames, session.frame, int(rest[:9]) if rest else len(frames))
    if odd is not None:
        index, by = odd
        top = frames[index - 1].base - 2 if index else cpu.sp
        bytes_there = amount(abs(by), "byte")
        where_there = (
            f"between iram[{frames[index].base + 1:#x}] and iram[{top:#x}] that no instruction pushed there"
        )
        session.tell(
            f"    the stack is out of step: frame {index} has {bytes_there} {where_there}"
            if by > 0
            else f"    the stack is out of step: frame {index} has {bytes_there} less than its instructions pushed"
        )
    elif not frames[-1].known:
        first = first or RESET_SP + 1
        over = amount(max(frames[-1].base - first + 1, 0), "byte")
        session.tell(f"    {over} of the stack, from iram[{first:#x}] on, cannot be explained")


def show_frames(session: Session, frames: list[StackFrame], chosen: int = -1, most: int = 1000) -> None:
    """Prints one line a frame, the innermost first."""
    for index, frame in enumerate(frames[:most]):
        how = "  <- interrupt" if frame.by_interrupt else ""
        place = session.symbols.place(frame.place)
        pc = "" if place.startswith("0x") else f"{frame.place:#06x}  "
        session.tell(f"{'*' if index == chosen else ' '}#{index}  {pc}{place}{how}")
    if not frames[-1].known and len(frames) <= most:
        session.tell("    the stack cannot be told from here on")


def select(session: Session, rest: str, step: int = 0) -> None:
    """Frame N, or `step` frames outwards N times; alone the present one."""
    frames = session.debugger.frames()
    if rest and not rest.isdecimal():
        raise BadInput("", "frame", f"{rest} is no number", f"there are 0 to {len(frames) - 1}")
    wanted = session.frame + step * int(rest[:9] or 1) if step else int(rest[:9] or session.frame)
    if not step and wanted >= len(frames):
        raise BadInput("", "frame", f"there is no frame {wanted}", f"there are 0 to {len(frames) - 1}")
    if step and not 0 <= session.frame + (1 if step > 0 else -1) < len(frames):
        raise BadInput("", "frame", "it is the outermost one" if step > 0 else "it is the innermost one")
    session.frame = min(max(wanted, 0), len(frames) - 1)
    show_frames(session, frames[: session.frame + 1], session.frame)
    del session.lines[: session.frame]
    line = session.symbols.line(frames[session.frame].place)
    if line is not None and (text := session.symbols.sources.text(line)):
        session.tell(f"{line.line:4}  {text}")


def who(session: Session, rest: str) -> None:
    writer = session.debugger.last_writer(session.debugger.bytes_of(rest))
    if writer is None:
        session.tell(f"nothing wrote {rest} before")
    else:
        session.tell(f"{session.time(writer[0], session.timeline.focus)}{rest} was last written by")
        show_frames(session, writer[1])


# Values


def show(session: Session, rest: str, how: str = "") -> None:
    """`print`: a value, in the form of gdb's letter."""
    value = expression(rest)(session.moment())
    for line in lines_of(rest, value, how):
        session.tell(line)


def display(session: Session, rest: str, how: str = "") -> None:
    """Shows values at each stop; without an argument, now.

    With a number or `i` and `s` in the form it shows the same as `x`.
    """
    if not rest:
        session.show_displays()
        return
    of_memory = bool(how) and (not how.isalpha() or how in ("i", "s"))

    def lines() -> list[str]:
        if of_memory:
            return list(_examined(session, _wanted(session, rest, how)))
        return list(lines_of(rest, expression(rest)(session.moment()), how))

    lines()
    display_number = next(at for at in count(1) if at not in session.displays)
    session.displays[display_number] = (f"{how and '/'}{how} {rest}".strip(), lines)
    for line in lines():
        session.tell(f"{display_number}: {line}")


def undisplay(session: Session, rest: str) -> None:
    for word in rest.split():
        if not word.isdecimal() or session.displays.pop(int(word[:9]), None) is None:
            raise BadInput("", "undisplay", f"there is no display {word}", "`info display` lists them")
    if not rest:
        session.displays.clear()


# Memory


def examine(session: Session, rest: str, how: str = "") -> None:
    """`x/8i PLACE`, `x/16xb PLACE`; without an argument it continues behind the last shown address."""
    session.examined = wanted = _wanted(session, rest, how)
    for line in _examined(session, wanted):
        session.tell(line)


def _wanted(session: Session, rest: str, how: str) -> Examined:
    wanted = copy(session.examined or Examined())
    parts = _EXAMINE.fullmatch(how)
    if parts is None:
        raise BadInput(
            "", f"x/{how}", "is no form", "give a number, a form and a size: x/8i, x/16xb, x/2dh, x/s"
        )
    if how:
        wanted.count = int(parts[1] or 1)
    for letter in parts[2]:
        if letter in _UNITS:
            wanted.size = _UNITS[letter]
        elif letter in FORMS:
            wanted.form = letter
        else:
            raise BadInput(
                "",
                f"x/{how}",
                f"{letter} is no form and no size",
                "forms: " + " ".join(FORMS) + "; sizes: b h w g",
            )
    if rest:
        wanted.space, wanted.address = _place_of(session, rest, wanted.form)
    elif session.examined is None:
        raise BadInput("", "x", "lacks a place", "x/8i $pc, x/16xb iram[0x30], x/s text")
    return wanted


def _place_of(session: Session, rest: str, form: str) -> tuple[str, int]:
    """(memory, address): where an expression lies or points to; a number alone is one of code, or of internal RAM."""
    if rest[:2].lower() == "0x" or rest[:1] == "*":
        rest = session.place(rest)
    value = expression(rest)(session.moment())
    if value.kind is not None and value.kind.kind == "pointer":
        value = pointed(value, 0, rest)
    if value.kind is not None and value.space in SIZES:
        return value.space, value.address
    address = number(value)
    space = value.space or ("code" if form == "i" else "iram")
    if not isinstance(address, int) or not 0 <= address < SIZES.get(space, 0):
        raise NoValue(f"{rest} is no place in {space}", "name the memory: xram[0x1234], code[0x1234]")
    return space, address


def _examined(session: Session, at: Examined) -> Iterator[str]:
    """Its lines; afterwards its address is that of the next unit."""
    if at.form == "i":
        yield from _instructions(session, at)
        return
    if at.form == "s":
        for _ in range(at.count):
            text = text_at(_bytes(session, at, 1)) or ""
            yield f"{at.space}[{at.address:#x}]: {quoted(text)}"
            at.address += len(text) + 1
        return
    left = at.count
    while left > 0:
        units = min(left, _ROW_BYTES[at.size] // at.size)
        value = _bytes(session, at, units * at.size)
        data = session.moment().read(value.space, value.address, units * at.size)
        words = [data[first : first + at.size] for first in range(0, len(data), at.size)]
        numbers = [int.from_bytes(word, "little") for word in words]
        yield f"{at.space}[{at.address:#x}]:  {'  '.join(in_form(number, at.form, at.size) for number in numbers)}"
        at.address += len(data)
        left -= units


def _bytes(session: Session, at: Examined, size: int) -> Value:
    if at.address + size > SIZES[at.space]:
        raise NoValue(f"{at.space} ends at {SIZES[at.space] - 1:#x}")
    return Value(space=at.space, address=at.address, moment=session.moment())


def _instructions(session: Session, at: Examined) -> Iterator[str]:
    if at.space != "code":
        raise NoValue(
            f"instructions are in code, and this is in {at.space}", "x/8i $pc, x/8i main, x/8i code[0x100]"
        )
    here = session.here().place
    for _ in range(min(at.count, SIZES["code"])):
        yield instruction(session, at.address, here)
        at.address = (at.address + LENGTH[session.debugger.cpu.code_at(at.address)]) & 0xFFFF


def instruction(session: Session, address: int, here: int) -> str:
    cpu = session.debugger.cpu
    data = bytes(cpu.code_at((address + at) & 0xFFFF) for at in range(LENGTH[cpu.code_at(address)]))
    text = disassemble(cpu.code, address, session.symbols.names)
    place = session.symbols.names.place(address)
    return f"{'=>' if address == here else '  '} {address:#06x} <{place}>  {data.hex(' '):8}  {text}"


# Source and code


def source(session: Session, rest: str) -> None:
    """The C lines around a line or a function; of an address, or without the file, the instructions."""
    here, wanted = session.here().place, session.place(rest)
    address = session.symbols.at(wanted)[0][0] if rest else here
    line = session.symbols.line(address)
    path = None if line is None else session.symbols.sources.path(line.file)
    if line is None or path is None or rest[:2].lower() == "0x" or rest[:1] == "*":
        listed = [row.address for row in session.symbols.listing]
        at = next((index for index, each in enumerate(listed) if each >= address), len(listed))
        _code(session, listed[max(0, at - LINES_AROUND) : at + LINES_AROUND + 1], here)
        return
    number_asked = wanted.rpartition(":")[2]
    middle = int(number_asked) if ":" in wanted and number_asked.isdecimal() else line.line
    stands = session.symbols.line(here)
    marked = stands.line if stands is not None and stands.file == line.file else -1
    for line_number, text in enumerate(read_text(path).splitlines(), 1):
        if abs(line_number - middle) <= LINES_AROUND:
            session.tell(f"{'=>' if line_number == marked else '  '} {line_number:4}  {text}")


def function(session: Session, rest: str) -> None:
    """`disassemble`: the instructions of a function, the C lines between them."""
    here = session.here().place
    address = session.symbols.at(session.place(rest))[0][0] if rest else here
    entry = session.symbols.entry(address)
    _code(
        session,
        [row.address for row in session.symbols.listing if session.symbols.entry(row.address) == entry],
        here,
    )


def _code(session: Session, addresses: list[int], here: int) -> None:
    shown_line = None
    for address in addresses:
        line = session.symbols.line(address)
        if line is not None and line != shown_line:
            session.tell(f"   ; {line}: {session.symbols.sources.text(line)}".rstrip(": "))
        shown_line = line
        session.tell(instruction(session, address, here))


# What there is


def info(session: Session, rest: str) -> None:
    word, _, more = rest.partition(" ")
    names = [name for name in INFO if name.startswith(word)] if word else []
    if not names:
        raise BadInput(
            "",
            f"info {word}".strip(),
            "is not known" if word else "lacks what to show",
            f"there are {', '.join(INFO)}",
        )
    INFO[names[0]](session, more.strip())


def _registers(session: Session, rest: str) -> None:
    for name in [word.lstrip("$").upper() for word in rest.split()] or SHOWN_REGISTERS:
        held = session.moment().find(name if name in (*SFRS, *SHOWN_REGISTERS) else name.lower(), "")
        session.tell(f"{name:5} {shown(held)}")


def _locals(session: Session, rest: str) -> None:
    there = session.moment().locals()
    for name, get in there.items():
        try:
            for line in lines_of(name, get()):
                session.tell(line)
        except BadInput as error:
            session.tell(f"{name}: {error}")
    if not there:
        session.tell("no local variables here")


def _frame(session: Session, rest: str) -> None:
    frames = session.debugger.frames()
    show_frames(session, frames[session.frame : session.frame + 1], 0)
    session.lines[-1] = session.lines[-1].replace("#0", f"#{session.frame}", 1)
    frame = frames[session.frame]
    top = frames[session.frame - 1].base - 2 if session.frame else session.debugger.cpu.sp
    session.tell(f"    entered at {frame.entry:#06x}" + (", by an interrupt" if frame.by_interrupt else ""))
    if session.frame + 1 < len(frames):
        back = frames[session.frame + 1].pc
        session.tell(
            f"    returns to {back:#06x} ({session.symbols.place(back)}), which is at iram[{frame.base - 1:#x}]"
        )
    pushed = session.moment().read("iram", frame.base + 1, top - frame.base) if top > frame.base else b""
    session.tell(
        f"    pushed since: {pushed.hex(' ')} from iram[{frame.base + 1:#x}] on"
        if pushed
        else "    nothing pushed since"
    )


def _line(session: Session, rest: str) -> None:
    symbols = session.symbols
    for address in symbols.at(session.place(rest))[0] if rest else [session.here().place]:
        line = symbols.line(address)
        if line is None:
            session.tell(f"{symbols.place(address)}: no line is known")
            continue
        first = max(begin for begin in symbols.line_begins if begin <= address)
        after = [row.address for row in symbols.listing if row.address > first]
        end = next((each for each in after if symbols.line(each) != line), first)
        session.tell(f"{line}: {first:#06x} to before {end:#06x}, in {symbols.function(address)}")


def _displays(session: Session, rest: str) -> None:
    for display_number, (text, _) in session.displays.items():
        session.tell(f"{display_number}: {text}")


INFO: dict[str, Callable[[Session, str], None]] = {
    "breakpoints": lambda session, rest: tell_all(session),
    "display": _displays,
    "frame": _frame,
    "line": _line,
    "locals": _locals,
    "registers": _registers,
    "stack": where,
    "watchpoints": lambda session, rest: tell_all(session),
}
"""Argument of `info` -> handler; for an ambiguous beginning the first entry is used."""
