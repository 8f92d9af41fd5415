"""Names of registers that some 8051 have and others lack, and which chip of ours has them: for messages.

Addresses are those of the makers' headers (Keil's AT89X52.H, STC's STC89C5xRC.H and STC12C5AxxS2.H).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple


class Known(NamedTuple):
    """Addresses from `first` to `last`. `chips`: those of ours that have them; `families`: others that have them."""

    first: int
    last: int
    name: str
    chips: tuple[str, ...] = ()
    families: str = ""


_STC12 = "STC12, STC15"
KNOWN = (
    Known(0x84, 0x85, "DP1, the second data pointer", ("at89s52",)),
    Known(0x8E, 0x8E, "AUXR", ("at89s52", "stc89c52")),
    Known(0xA2, 0xA2, "AUXR1, the switch of data pointers", ("at89s52", "stc89c52")),
    Known(0xA6, 0xA6, "WDTRST, the watchdog", ("at89s52",)),
    Known(0xB7, 0xB7, "IPH, priorities of interrupts", ("stc89c52",)),
    Known(0xC8, 0xCD, "timer 2", ("at89c52", "at89s52", "stc89c52")),
    Known(0xE1, 0xE1, "WDT_CONTR, the watchdog", ("stc89c52",)),
    Known(0xE2, 0xE7, "ISP/IAP, the data flash", ("stc89c52",)),
    Known(0xE8, 0xE8, "P4", ("stc89c52",)),
    Known(0x86, 0x86, "SPDR, the SPI port", (), "AT89S8252"),
    Known(0x8F, 0x8F, "WAKE_CLKO, INT_CLKO", (), _STC12),
    Known(0x91, 0x96, "P0M0 to P2M1, modes of ports", (), _STC12),
    Known(0x97, 0x97, "CLK_DIV, the clock divider", (), _STC12),
    Known(0x9A, 0x9B, "S2CON and S2BUF, the second serial port", (), _STC12),
    Known(0x9C, 0x9C, "BRT, the baud rate generator", (), _STC12),
    Known(0x9D, 0x9D, "P1ASF, analog inputs", (), _STC12),
    Known(0xA9, 0xA9, "SADDR, the slave address", (), "STC89, P89C51Rx2"),
    Known(0xAA, 0xAA, "SPSR, or a wake-up timer", (), f"AT89S8252, {_STC12}"),
    Known(0xAF, 0xAF, "IE2", (), _STC12),
    Known(0xB1, 0xB4, "P3M1 to P4M0, modes of ports", (), _STC12),
    Known(0xB9, 0xB9, "SADEN, the slave address's mask", (), "STC89, P89C51Rx2"),
    Known(0xBC, 0xBE, "ADC_CONTR and its result", (), _STC12),
    Known(0xC0, 0xC0, "XICON, or P4", (), f"STC89, {_STC12}"),
    Known(0xC1, 0xC1, "WDT_CONTR, the watchdog", (), _STC12),
    Known(0xC2, 0xC7, "IAP, the data flash", (), _STC12),
    Known(0xD5, 0xD5, "SPCR, the SPI port", (), "AT89S8252"),
    Known(0xD8, 0xDF, "CCON to CCAPM4, the counter array", (), f"P89C51Rx2, {_STC12}"),
    Known(0xE9, 0xEF, "CL and CCAPnL, the counter array", (), f"P89C51Rx2, {_STC12}"),
    Known(0xF9, 0xFF, "CH and CCAPnH, the counter array", (), f"P89C51Rx2, {_STC12}"),
)


def lacking_lines(chip: str, counts: Mapping[int, int]) -> Iterator[str]:
    """A line for each group of registers that the chip lacks. `counts`: accesses by address."""
    left = {address: count for address, count in counts.items() if count}
    for known in KNOWN:
        taken = {
            address: left.pop(address) for address in sorted(left) if known.first <= address <= known.last
        }
        if not taken or chip in known.chips:
            continue
        if known.chips:
            remedy = f'chip = "{known.chips[0]}" has {"it" if known.first == known.last else "them"}'
        else:
            remedy = f"no chip here has it, {known.families} have"
        yield f"the {chip} lacks {_addresses(taken)} ({known.name}), accessed {times(sum(taken.values()))}; {remedy}"
    if left:
        yield f"the {chip} lacks {_addresses(left)}, accessed {times(sum(left.values()))}; they read FFh"


def _addresses(taken: Mapping[int, int]) -> str:
    first, last = min(taken), max(taken)
    if len(taken) > 2 and len(taken) == last - first + 1:
        return f"{first:02X}h to {last:02X}h"
    return ", ".join(f"{address:02X}h" for address in sorted(taken))


def times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
