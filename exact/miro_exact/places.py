"""What the build adds to each hot module: where in memory the fields of its classes lie.

Loaded from its file by setup.py, before anything is installed, so it imports nothing of ours.

For every `cdef class` there is a function `_places_CLASS(part)`. It gives name -> (address, C type, size in bytes) of
all fields that are plain C data. Fields that are Python objects are not in it; fields of base classes are in theirs.
"""

from __future__ import annotations

import re

C_TYPES = (
    *("unsigned long long", "long long", "unsigned int", "unsigned short", "unsigned char"),
    *("short", "int", "bint", "double"),
)
_CLASS = re.compile(r"^cdef class (\w+)[^\n]*:\n((?:(?:[ \t]+[^\n]*)?\n)*)", re.M)
_FIELD = re.compile(rf"^    cdef (?:public |readonly )?({'|'.join(C_TYPES)}) ([\w\[\], ]+)$", re.M)
_ALIASES = {"u64_t": "unsigned long long"}

HEAD = """

import cython as _cython
"""
FUNCTION = """

@_cython.locals(part={name})
def _places_{name}(part):
    return {{
{lines}    }}
"""
LINE = (
    '        "{field}": (_cython.cast("size_t", _cython.address(part.{first})), "{c_type}", '
    "_cython.sizeof(part.{field})),\n"
)


def fields_of(layout: str) -> dict[str, list[tuple[str, str, bool]]]:
    """Class -> (name, C type, whether it is an array) of its plain fields, from the text of a `.pxd`."""
    for alias, c_type in _ALIASES.items():
        layout = re.sub(rf"\b{alias}\b", c_type, layout)
    layout = re.sub(r" *#[^\n]*", "", layout)
    found: dict[str, list[tuple[str, str, bool]]] = {}
    for name, body in _CLASS.findall(layout):
        found[name] = []
        for c_type, names in _FIELD.findall(body):
            for declared in names.split(","):
                field, bracket, _ = declared.strip().partition("[")
                found[name].append((field, c_type, bool(bracket)))
    return found


def text(layout: str) -> str:
    """What is appended to the source of the module that this `.pxd` belongs to."""
    functions = []
    for name, fields in fields_of(layout).items():
        lines = "".join(
            LINE.format(field=field, c_type=c_type, first=f"{field}[0]" if is_array else field)
            for field, c_type, is_array in fields
        )
        functions.append(FUNCTION.format(name=name, lines=lines))
    return HEAD + "".join(functions) if functions else ""
