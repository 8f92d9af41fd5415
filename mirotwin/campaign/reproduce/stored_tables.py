"""Tables of results in a JSON file: texts, as a page shows them."""

from __future__ import annotations

from pathlib import Path

import msgspec

Row = list[str]


class StoredTables(msgspec.Struct, frozen=True):
    """`about`: how they were made. `tables`: each with its head."""

    about: dict[str, str]
    tables: dict[str, list[Row]]

    def rows(self, name: str) -> list[Row]:
        """The rows of a table, without its head."""
        return self.tables[name][1:]

    def write(self, path: Path) -> None:
        """A line for each row, so that a change shows which."""
        tables = ",\n".join(
            f'"{name}":[\n' + ",\n".join(msgspec.json.encode(row).decode() for row in rows) + "\n]"
            for name, rows in self.tables.items()
        )
        about = msgspec.json.encode(self.about).decode()
        path.write_text(f'{{"about":{about},\n"tables":{{\n{tables}\n}}}}\n', encoding="utf-8")


def read(path: Path) -> StoredTables:
    return msgspec.json.decode(path.read_bytes(), type=StoredTables)
