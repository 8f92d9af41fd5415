"""Where the vectors are."""

from pathlib import Path

MCS51 = Path(__file__).with_name("mcs51")
