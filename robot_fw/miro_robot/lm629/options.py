"""Choices for undocumented behaviour, one named field per rule: the default is this twin's choice.

If a measured chip behaves in the other way, set the other reading in a scenario's
`[lm629]` table or as `Lm629Options(...)`. README.md in this folder says where rules come from.
Page numbers are those of the data sheet SNVS781C.
"""

from __future__ import annotations

from typing import Literal, get_args, get_type_hints

import msgspec


class Lm629Options(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Readings of the undocumented corners. Lengths are in chip clocks.

    Raises ValueError when a length is out of range or a word is none of its choices.
    """

    # Bus
    busy_clocks: int = 120
    """B1: how long the busy bit stays after a command byte or the second byte of a data word (p. 12: 15 to 25 us)."""
    busy_judged: Literal["begin", "end"] = "begin"
    """B2: a write is lost if the chip is busy when the strobe begins, or when it ends."""
    command_resets_phase: bool = True
    """B3: a command byte begins a new word; False: half a word that came before it goes on."""
    unknown_opcode_flags: bool = True
    """E1: an unknown opcode raises the command error."""
    undue_data_flags: bool = True
    """E2: data when no word is due at all raises the command error (in the wrong direction: always)."""
    unfinished_flags: bool = True
    """E3: a command byte before the last word of another raises the command error; complete parameters are kept."""
    status_read_flags: bool = False
    """E4: reading the status byte while a word from the host is due raises the command error."""
    range_flags: bool = False
    """E5: a parameter out of its range raises the command error."""
    out_of_range: Literal["masked", "clamped"] = "masked"
    """W1: such a parameter keeps its low bits (velocity, acceleration 30, position 31, others 15), or becomes the
    nearest that fits (relative ones: always masked)."""

    # Interrupts
    interrupt: Literal["level", "event"] = "level"
    """I1: HI follows (flags AND mask), or is latched by flags that rise and cleared by any RSTI."""
    error_flag_repeats: bool = True
    """I2: the excessive-error flag comes back each sample that the error persists; False: once per excess."""
    reset_interrupts: bool = True
    """I3: the flag that a reset raises (trajectory complete) also raises HI: signals 8184h, else 0184h; False has a
    meaning with `event` alone."""
    hi_falls: Literal["busy", "latch"] = "busy"
    """I4: HI falls when the RSTI or MSKI that ends it is no longer busy, or when its last byte is latched."""

    # Reset
    reset_clocks: int = 6144
    """R1: from the end of the reset pulse (or the RESET command) to status 84h."""
    software_reset_busy: bool = True
    """R2: the status byte is 01h while a RESET command runs; False: 00h."""
    reset_breakpoint: Literal["none", "fires", "stays"] = "none"
    """R3: no breakpoint after a reset (84h); one at 0, which fires in the first sample (C4h, then 80h); or its flag is
    set (C4h), and the first RSTI leaves it (C0h)."""
    reset_restarts_samples: bool = True
    """R4: samples and PWM count from the end of the reset; False: they go on in the grid of tick 0."""
    reset_clears_lpes: bool = True
    """R5: a RESET command ends "stop on excessive error"."""
    reset_clears_index: bool = True
    """R6: a reset clears the index register and a SIP that is pending; False: both stay."""
    reset_pulse_clocks: int = 8
    """R7: a shorter low on /RST, or none at power-up, leaves the chip stuck at status 00h."""

    # Start and stop
    start_takes: Literal["given", "sample"] = "given"
    """T1: STT takes the buffers as they are when it is given, or as they are at the sample that executes it."""
    start_shows: Literal["accepted", "sample"] = "accepted"
    """T10: signals bits 7, 10, 11 and 12 change when STT is accepted (p. 23), or at the sample that executes it."""
    second_start: Literal["replaces", "follows"] = "replaces"
    """T11: an STT before the sample of another one takes its place, or makes it take effect at once."""
    stop_lifts_refusal: bool = True
    """T2: a stop word in the buffer lets STT pass in spite of an acceleration loaded in motion."""
    stop_bits_stay: bool = False
    """T3: stop bits serve every STT until the next LTRJ; False: one."""
    unsent: Literal["buffer", "working"] = "buffer"
    """T4: parameters that an LTRJ does not send stay as last loaded, or become what is in force."""
    relative_rates: Literal["working", "buffer"] = "working"
    """T5: what a relative velocity or acceleration adds to."""
    relative_base: Literal["target", "desired", "real"] = "target"
    """T6: what a relative position adds to; `target` means the desired position while in velocity mode."""
    home_shifts_buffer: bool = False
    """D1: DFH also shifts a target that is loaded and not yet started."""

    # Profile and flags
    abrupt_stop_at: Literal["real", "desired"] = "real"
    """P1: the "current position" at which an abrupt stop holds."""
    stop_keeps_fraction: bool = False
    """P2: after a smooth stop the desired position keeps its fraction; False: it is rounded down."""
    breakpoint_exact: bool = False
    """P3: a breakpoint fires in a sample that ends on it; False: also when it was passed between two samples."""
    breakpoint_base: Literal["accepted", "working"] = "accepted"
    """P5: SBPR adds to the target of the last accepted STT ("accepted"), or to the one that a sample has executed
    ("working").
    """
    read_position: Literal["sample", "live"] = "sample"
    """P4: RDRP answers the position of the last sample, or the counter as it is."""

    # Filter
    pid_saturates: bool = True
    """F1: products and their sum stop at +-full scale (p. 10); False keeps their bottom 16 bits (p. 12)."""
    sum_reading: Literal["term", "sum"] = "term"
    """F2: RDSUM answers the limited product ki * sum, or the limited top 16 bits of the sum itself."""
    sum_rounding: Literal["down", "zero"] = "down"
    """F6: which way the top 16 bits of a negative error sum are rounded."""
    open_loop_clears: bool = True
    """F3: a motor that is off forgets sum, error history and derivative."""
    update_clears: bool = False
    """F4: UDF forgets them too; it always restarts the derivative interval."""
    error_test: Literal["full", "saturated"] = "full"
    """F5: the error threshold is compared with the whole error, or with its 16 bits."""

    # Output
    output_rounding: Literal["down", "zero"] = "down"
    """O1: which way a negative drive is rounded to sign and magnitude (16 bits shifted by 8, at most 127)."""
    sign_of_negative: Literal[1, 0] = 1
    """O2: level of the sign pin for negative torque."""
    pulse_at: Literal["start", "end"] = "start"
    """O3: where in its period the PWM pulse, 4 clocks a step, is."""
    off_keeps_sign: bool = False
    """O4: a motor that is switched off keeps the level of its sign pin; False: 0."""
    port12_clears: bool = True
    """O5: PORT12 clears bit 8 of the signals register, PORT8 sets it (p. 23); False: both mean nothing."""

    # Encoder
    double_step: Literal[0, 2, -2] = 0
    """X1: what A and B changing at once count."""
    filter_clocks: int = 8
    """X2: equal samples that make a new level of A/B or /IN count; 0 lets every edge through at once."""

    def __post_init__(self) -> None:
        for name, least, most in LENGTHS:
            value = getattr(self, name)
            if not least <= value <= most:
                raise ValueError(f"{name} must be {least}..{most} clocks, not {value}")
        for name, choices in CHOICES.items():
            if getattr(self, name) not in choices:
                words = ", ".join(str(choice) for choice in choices)
                raise ValueError(f"{name} must be one of {words}, not {getattr(self, name)!r}")


LENGTHS = (
    ("busy_clocks", 0, 1 << 20),
    ("reset_clocks", 1, 1 << 24),
    ("reset_pulse_clocks", 0, 1 << 20),
    ("filter_clocks", 0, 1024),
)
CHOICES = {
    name: (False, True) if hint is bool else get_args(hint)
    for name, hint in get_type_hints(Lm629Options).items()
    if hint is not int
}
DEFAULT_OPTIONS = Lm629Options()
