"""Changes the build makes to each hot module: it adds the addresses of fields, and removes zero initialisation of
arrays.

Loaded from its file by setup.py, before anything is installed, so it imports none of our packages.

For every `cdef class` there is a function `_places_CLASS(part)`. It gives name -> (address, C type, size in bytes) of
all fields that are plain C data. Fields that are Python objects are not in it; fields of base classes are in theirs.

A new object of a compiled class is all zero bits. So `self.NAME = [0] * N` in its `__init__` changes nothing, but costs
time for N list items. In Python it makes the list.
"""

from __future__ import annotations

import ast
import re

C_TYPES = (
    *("unsigned long long", "long long", "unsigned int", "unsigned short", "unsigned char"),
    *("short", "int", "bint", "double"),
)
_CLASS = re.compile(r"^cdef class (\w+)[^\n]*:\n((?:(?:[ \t]+[^\n]*)?\n)*)", re.M)
_FIELD = re.compile(rf"^    cdef (?:public |readonly )?({'|'.join(C_TYPES)}) ([\w\[\], ]+)$", re.M)
_ALIASES = {"u64_t": "unsigned long long"}

_ZEROS = re.compile(r"self\.(\w+) = (?:\[0(?:\.0)?\] \* \w+|bytearray\(\w+\))")

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
    fields: dict[str, list[tuple[str, str, bool]]] = {}
    for name, body in _CLASS.findall(layout):
        fields[name] = []
        for c_type, names in _FIELD.findall(body):
            for declared in names.split(","):
                field, bracket, _ = declared.strip().partition("[")
                fields[name].append((field, c_type, bool(bracket)))
    return fields


def text(layout: str) -> str:
    """The text appended to the source of the module of this `.pxd`."""
    functions = []
    for name, fields in fields_of(layout).items():
        lines = "".join(
            LINE.format(field=field, c_type=c_type, first=f"{field}[0]" if is_array else field)
            for field, c_type, is_array in fields
        )
        functions.append(FUNCTION.format(name=name, lines=lines))
    return HEAD + "".join(functions) if functions else ""


def without_zeros(source: str, layout: str) -> str:
    """The source of a module without the zero initialisation of C arrays in new objects. Line numbers stay the same."""
    fields = fields_of(layout)
    lines = source.splitlines(keepends=True)
    for made in (node for node in ast.parse(source).body if isinstance(node, ast.ClassDef)):
        arrays = {name for name, _, is_array in fields.get(made.name, ()) if is_array}
        for method in made.body:
            if isinstance(method, ast.FunctionDef) and method.name == "__init__":
                for statement in method.body:
                    match = _ZEROS.fullmatch(ast.unparse(statement))
                    if match is not None and match[1] in arrays and statement.lineno == statement.end_lineno:
                        lines[statement.lineno - 1] = " " * statement.col_offset + "pass\n"
    return "".join(lines)
