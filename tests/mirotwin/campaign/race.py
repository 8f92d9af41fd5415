"""Firmware with a race: the serial interrupt clears a count between the main loop's look at it and its decrement.

A damaged character sets the count, a good one clears it, and each millisecond takes one away. Where a good character
comes in between, 0 becomes 255: the firmware takes that for a band full of noise, and is deaf until it is reset.

    python -m tests.mirotwin.campaign.race       writes examples/firmware/race.ihx
"""

import shutil
from pathlib import Path

from tests.mutants.build import build
from tests.mutants.draw import source_files

PLACE = Path(__file__).parents[3] / "examples" / "firmware" / "race.ihx"
CHANGES = (
    ("uart.c", "volatile u8 rx_count;\n", "volatile u8 rx_count;\nvolatile u8 noisy;\n"),
    (
        "uart.c",
        "            TF0 = 0;\n            RI = 0;\n",
        "            noisy = mark == MARK_DAMAGED ? 8 : 0;\n            TF0 = 0;\n            RI = 0;\n",
    ),
    ("uart.h", "extern volatile u8 rx_count;", "extern volatile u8 noisy;\nextern volatile u8 rx_count;"),
    ("failsafe.c", "static __bit heard;", "static __bit deaf;\nstatic __bit heard;"),
    (
        "failsafe.c",
        "    watch_tick();\n    motion_tick();\n",
        "    if (noisy)\n        --noisy;\n    if (noisy > 8)\n        deaf = 1;\n"
        "    watch_tick();\n    motion_tick();\n",
    ),
    (
        "failsafe.c",
        "    look_back();\n    if (heard",
        "    if (deaf)\n        return false;\n    look_back();\n    if (heard",
    ),
)


def racing():
    """The image."""
    sources = source_files()
    for file, right, wrong in CHANGES:
        assert sources[file].count(right) == 1, (file, right)
        sources[file] = sources[file].replace(right, wrong)
    return build({file: sources[file] for file, _, _ in CHANGES})


if __name__ == "__main__":
    shutil.copy(racing().image, PLACE)
