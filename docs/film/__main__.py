"""The recorded terminal of docs/start.md: `python -m docs.film` writes `docs/terminal.svg`.

A good run, the same run over a bad radio, whose check fails on purpose, and its recording sent again: the same failure
at the same tick. The commands are run, and what is drawn is what they print. Times are those of this table, not those
measured, so the file changes only when the text does. One text differs from run to run: how long a run took.
"""

from __future__ import annotations

import sys
from pathlib import Path

from docs.film.picture import Shot, picture
from docs.film.terminal import recorded

COLUMNS = 88
ROWS = 24
TARGET = Path(__file__).parents[1] / "terminal.svg"
COMMANDS = (
    "mirotwin run fig6 --expect tracks_within_cm=3",
    "mirotwin run fig6 --expect tracks_within_cm=3 --set network.radio.bit_error_rate=0.008 --out bad",
    "mirotwin replay bad/run.mcap 2>&1 | tail -3   # what failed, again: bit for bit",
)
KEY_S = 0.035
"""Between two characters that are typed."""
THINK_S = 0.9
"""Before the output of a command, about as long as it takes, and before the next command."""
LINE_S = 0.07
READ_S = 2.5
"""After the output of a command."""
END_S = 6.0


def shots() -> list[Shot]:
    """The commands with what they print, and when."""
    found = []
    now_s = 0.5
    for command, lines in zip(COMMANDS, recorded(COMMANDS, COLUMNS, ROWS), strict=True):
        answered_s = now_s + KEY_S * len(command) + THINK_S
        found.append(Shot(command, now_s, KEY_S, lines, answered_s, LINE_S))
        now_s = answered_s + LINE_S * len(lines) + READ_S
    return found


def main() -> int:
    TARGET.write_text(picture(shots(), COLUMNS, ROWS, END_S), encoding="utf-8")
    print(f"{TARGET}: {TARGET.stat().st_size // 1024} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
