"""Where the vectors are."""

from pathlib import Path

VECTORS = Path(__file__).parent
MCS51 = VECTORS / "mcs51"
CASES = VECTORS / "cases"
"""Inputs that once got a wrong answer."""
