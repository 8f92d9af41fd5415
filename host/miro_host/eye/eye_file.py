"""Files of the eye: TOML and CSV, with errors that name file, place and remedy."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import TypeVar

import msgspec

from miro_exact.bad_input import BadInput
from miro_exact.inputs import EYE_BYTES, read_input
from miro_protocol.toml_text import TomlError, check_numbers, struct_of, tables, without_none

T = TypeVar("T", bound=msgspec.Struct)


class EyeError(BadInput):
    """A calibration, colours or points that cannot be used."""


def read(path: str | Path, kind: type[T]) -> T:
    """The struct in a TOML file. Raises EyeError for one that cannot be read, and as `parse` does."""
    return parse(text_of(path), kind, f"{path}")


def text_of(path: str | Path) -> str:
    """A file's text. Raises EyeError."""
    with EyeError.at(path):
        try:
            return read_input(path, EYE_BYTES).decode("utf-8-sig")
        except OSError as error:
            problem = f"cannot be read: {error.strerror}"
            raise EyeError(path, "", problem, "check path and permissions") from None
        except UnicodeDecodeError:
            raise EyeError(path, "", "not UTF-8 text", "give a text file") from None


def csv_rows(text: str, origin: str, *columns: tuple[str, ...]) -> Iterator[tuple[int, dict[str, str]]]:
    """Line number, and cells by column, of each row of CSV text that has one of these sets of `columns`.

    Raises EyeError with the line for other columns and for a row without them.
    """
    reader = csv.reader(io.StringIO(text))
    try:
        header = [name.strip() for name in next(reader, [])]
        if sorted(header) not in map(sorted, columns):
            remedy = f"they must be {' or '.join(', '.join(names) for names in columns)}"
            raise EyeError(origin, 1, f"the columns are {', '.join(header)}", remedy)
        for row in filter(None, reader):
            if len(row) != len(header):
                raise EyeError(
                    origin, reader.line_num, f"{len(row)} cells", f"a line must have {len(header)}"
                )
            yield reader.line_num, dict(zip(header, row, strict=True))
    except csv.Error as error:
        raise EyeError(origin, reader.line_num, f"is no CSV: {error}", "mend the line") from None


def parse(text: str, kind: type[T], origin: str) -> T:
    """The struct in TOML text. Raises EyeError with the key for unknown keys, wrong types and values out of range."""
    try:
        table = tables(text)
        check_numbers(table)
        return struct_of(table, kind)
    except TomlError as error:
        raise EyeError(origin, error.place, error.what, error.remedy or "mend the text") from None


def text(struct: msgspec.Struct) -> str:
    """The struct as TOML text that `parse` reads back as the same struct. None values are left out."""
    import tomli_w  # only who writes a file needs it

    return tomli_w.dumps(without_none(msgspec.to_builtins(struct)))
