"""The C of a module, made faster before it is compiled: its interpreter's loop and its constants. Used by the build."""

from __future__ import annotations

import re
from collections import Counter

INTERPRETER_ARMS = 64  # a loop around a choice of at least so many executes a program
SWITCH_OF_A_LOOP = re.compile(
    r"^(?P<indent> +)switch \((?P<value>\w+)\) {\n(?P<arms>(?:(?!}).*\n)*?)(?P=indent)  default: break;\n(?P=indent)}\n"
    r"(?P=indent)(?P<again>__pyx_L\w+):;\n",
    re.M,
)
"""Within one function: none of its lines begins with a brace."""


def threaded(c: str, mark: bytes) -> str:
    """C in which every arm of an interpreter's loop fetches the next instruction and jumps to its arm by itself.

    Processors predict an indirect jump from where it is and what was jumped before: one jump for the whole loop mixes
    all instructions up. Compilers do not copy it, so the loop's head, from `while` to `switch`, is copied to the end of
    each arm (labels as values: GCC and Clang); what the head asks before each instruction is taken to be rare.
    Text that is not as Cython 3 writes it stays as it is: slower, the same bits. What was reshaped carries a mark, by
    which `mirotwin info` says so: `mark`.
    """
    for switch in SWITCH_OF_A_LOOP.finditer(c):
        indent, value, arms, again = switch["indent"], switch["value"], switch["arms"], switch["again"]
        numbers = {int(number, 0) for number in re.findall(rf"^{indent}  case (\w+):", arms, re.M)}
        before, loop, head = c[: switch.start()].rpartition(f"{indent[2:]}while (1) {{\n")
        if len(numbers) < INTERPRETER_ARMS or max(numbers) > 0xFF or not loop or "\n}\n" in head:
            continue
        targets = (f"&&arm_{number}" if number in numbers else f"&&{again}" for number in range(0x100))
        table = f"static void *const arm_of[0x100] = {{{', '.join(targets)}}};\n"
        head = re.sub(r"/\*.*?\*/", "", head, flags=re.S)
        head = re.sub(r"if \((__pyx_t_\w+)\) {", r"if (unlikely(\1)) {", head)
        step = f"{head}if ({value} < 0 || {value} > 0xFF) goto {again};\ngoto *arm_of[{value}];\n"
        arms = re.sub(
            rf"^{indent}  case (\w+):", lambda case: f"{case[0]} arm_{int(case[1], 0)}:;", arms, flags=re.M
        )
        arms = re.sub(rf"^{indent}  break;\n", step.replace("\\", r"\\"), arms, flags=re.M)
        first, last = switch.span("arms")
        sign = f'static const char dispatch[] __attribute__((used)) = "{mark.decode()}";\n'
        return before + table + loop + head + c[switch.start() : first] + arms + c[last:] + sign
    return c


_NUMBER = r"-?(?:0x[0-9A-Fa-f]+|\d+|\d*\.?\d+(?:e[+-]?\d+)?)"
_SET = re.compile(r"\b(__pyx_v_\d\w+) = ")
_SETTING = re.compile(rf"^  (__pyx_v_\d\w+) = ({_NUMBER}|__pyx_t_\d+);\n", re.M)
_DECLARED = re.compile(r"^static (int|PY_LONG_LONG|double|[\w ]*__pyx_t_\w+) (__pyx_v_\d\w+);\n", re.M)


def constants(c: str) -> str:
    """C in which a `static int NAME;` that is set once, to a number, is `static int const NAME = NUMBER;`.

    Cython makes variables of a module's typed names, which a compiler must load again and again. Those that are set
    together (`A, B = 1, 2`) go through temporaries. Text that is not as Cython 3 writes it stays as it is: slower, the
    same bits.
    """
    declared = {name for _, name in _DECLARED.findall(c)}
    times = Counter(_SET.findall(c))
    numbers = {}
    for setting in _SETTING.finditer(c):
        name, value = setting.groups()
        if name in declared and times[name] == 1:
            numbers[name] = _number(c, setting.start(), value)
    c = _SETTING.sub(lambda setting: "" if numbers.get(setting[1]) else setting[0], c)
    return _DECLARED.sub(lambda one: _constant(one[1], one[2], numbers.get(one[2], "")), c)


def _number(c: str, end: int, value: str) -> str:
    """The number that `value` is; that of a temporary was set last before `end`. "" if it is none."""
    if value.startswith("__pyx_t_"):
        setting = f"  {value} = "
        place = c.rfind(setting, 0, end)
        value = c[place + len(setting) : c.find(";", place)] if place >= 0 else ""
    return value if re.fullmatch(_NUMBER, value) else ""


def _constant(c_type: str, name: str, number: str) -> str:
    return f"static {c_type} const {name} = {number};\n" if number else f"static {c_type} {name};\n"
