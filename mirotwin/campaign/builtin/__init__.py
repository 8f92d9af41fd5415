"""Campaigns that are part of the program, as files: `mirotwin campaign bench1`.

What belongs here: their names, where they are, the files and their scenarios. What does not: reading them
(`campaign.file`).
"""

from pathlib import Path

FOLDER = Path(__file__).parent


def names() -> list[str]:
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def place(name: str) -> Path | None:
    """The file of a built-in campaign; None for any other name."""
    return FOLDER / f"{name}.toml" if name in names() else None
