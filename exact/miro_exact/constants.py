"""The C of a module, in which names that are set once, to a number, are constants. Used by the build."""

from __future__ import annotations

import re

_NUMBER = r"-?(?:0x[0-9A-Fa-f]+|\d+|\d*\.?\d+(?:e[+-]?\d+)?)"
_DECLARED = re.compile(r"^static (int|PY_LONG_LONG|double|[\w ]*__pyx_t_\w+) (__pyx_v_\d\w+);\n", re.M)


def constants(c: str) -> str:
    """C in which a `static int NAME;` that is set once, to a number, is `static int const NAME = NUMBER;`.

    Cython makes variables of a module's typed names, which a compiler must load again and again. Text that is not as
    Cython 3 writes it stays as it is: slower, the same bits.
    """
    for c_type, name in _DECLARED.findall(c):
        settings = re.findall(rf"^  {name} = ({_NUMBER});\n", c, re.M)
        if len(settings) != 1 or len(re.findall(rf"\b{name} = ", c)) != 1:
            continue
        c = c.replace(f"static {c_type} {name};\n", f"static {c_type} const {name} = {settings[0]};\n")
        c = c.replace(f"  {name} = {settings[0]};\n", "")
    return c
