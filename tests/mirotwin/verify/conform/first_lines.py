"""Usual mistakes, and words that the first three lines of `mirotwin conform` must say of firmware with one of them."""

from typing import NamedTuple


class Named(NamedTuple):
    """`says`: all of it. `source`: file, right and wrong text, unless the mistake is one of `MISTAKES` or `PLANTED`."""

    says: tuple[str, ...]
    source: tuple[str, str, str] | None = None


_SPEED = "    lm629_word(0, HIGH(speed));\n    lm629_word(LOW(speed), 0);"
_PLAIN = "because a plain team frame is not obeyed"
FIRST_LINES = {
    "the sign of both": Named(
        (_PLAIN, "begin with P24", "found -978 (FC2Eh), 983 (03D7h)", "the signs of both are turned over"),
        (
            "motion.c",
            "    u16 speed = velocity;\n",
            "    u16 speed;\n\n    velocity = -velocity;\n    speed = velocity;\n",
        ),
    ),
    "drives backward velocities forward": Named((_PLAIN, "the right one goes the wrong way")),
    "swaps the wheels": Named((_PLAIN, "left and right are exchanged")),
    "takes the velocities of the robot before it": Named((_PLAIN, "these are the velocities of robot 0")),
    "takes bytes the other way round": Named((_PLAIN, "the bytes of each are exchanged")),
    "twice the velocity": Named(
        (_PLAIN, "2 times as fast"), ("motion.c", _SPEED, "    speed <<= 1;\n" + _SPEED)
    ),
    "velocities that are not started": Named(
        (_PLAIN, "loaded, but not started (STT)"), ("motion.c", "    lm629_command(STT);\n", "")
    ),
    "begins the CRC without the layout byte": Named(
        (_PLAIN, "it obeys frames with another CRC (no layout byte)")
    ),
    "a CRC that begins with 0": Named(
        (_PLAIN, "0000h and not FFFFh at the start"),
        ("wire.c", "    crc_low = crc & 0xFF;\n    crc_high = crc >> 8;", "    crc_low = crc_high = 0;"),
    ),
    "a CRC without the last XOR": Named(
        (_PLAIN, "it obeys frames with another CRC (no XOR with FFFFh at the end)"),
        (
            "decode.c",
            "return crc_low == (CRC_RESIDUE & 0xFF) && crc_high == CRC_RESIDUE >> 8;",
            "return !crc_low && !crc_high;",
        ),
    ),
    "whitening that begins late": Named(
        (_PLAIN, "whitening that begins with the second byte of its string"),
        ("wire.c", "    at = 0;", "    at = 1;"),
    ),
    "no whitening": Named(
        (_PLAIN, "it obeys frames with no whitening"), ("wire.c", "value ^ whitening[at++]", "value")
    ),
    "does not whiten its answers": Named(("begin with P42", "its HDR 96h is not whitened")),
    "the high byte of the answer's CRC first": Named(
        ("begin with P42", "high byte sent first"),
        (
            "telemetry.c",
            "    tx_frame[at++] = wire_whiten(low);\n    tx_frame[at] = wire_whiten(high);",
            "    tx_frame[at++] = wire_whiten(high);\n    tx_frame[at] = wire_whiten(low);",
        ),
    ),
    "a reload of the bit rate that is off by one": Named(
        ("begin with P42", "at 9615 baud", "9740 baud"),
        ("uart.c", "    RCAP2L = TIMER2_RELOAD_LOW;\n", "    RCAP2L = TIMER2_RELOAD_LOW + 1;\n"),
    ),
    "half the bit rate": Named(
        (_PLAIN, "its serial port takes 7 of 23 characters"),
        ("uart.c", "    RCAP2L = TIMER2_RELOAD_LOW;\n", "    RCAP2L = TIMER2_RELOAD_LOW - 78;\n"),
    ),
    "takes 7 steps": Named(("P16", "team frame 8 steps on")),
    "acts on a frame that is repeated": Named(("begin with P17", "0 steps on, seq 21 not acted on")),
    "stops after 100 ms": Named(
        ("begin with P29", "found the left one 99.94 ms after it"),
        ("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == 100)"),
    ),
    "stops 15 ms late": Named(("begin with P29", "found left at 124.94 ms, right at 124.94 ms")),
    "never stops": Named(("begin with P29", "found left not within 5")),
    "stops by opening the loops": Named(
        ("begin with P31", "wanted a smooth stop, found the left wheel told off")
    ),
    "never goes off": Named(("begin with P32", "found left not within 734.88 ms")),
    "never answers": Named(
        ("begin with P42", "wanted an answer to some of 9 questions in a row, found none")
    ),
    "answers that come late": Named(
        ("begin with P41", "found one that is over 40.93 ms after the question's end"),
        (
            "telemetry.c",
            "    begin();\n    put(TYPE",
            "    { u16 i; for (i = 0; i != 6000; ++i) { P1_7 = 1; } }\n    begin();\n    put(TYPE",
        ),
    ),
    "answers every question": Named(
        ("begin with P41", "is for robot 0", "an answer of robot 1 to question 60")
    ),
    "positions of the other wheel": Named(
        ("begin with P47", "that is the other wheel's"),
        (
            "telemetry.c",
            "    put_word(position(LEFT));\n    put_word(position(RIGHT));",
            "    put_word(position(RIGHT));\n    put_word(position(LEFT));",
        ),
    ),
    "positions with the high byte first": Named(
        ("begin with P47", "its bytes are exchanged"),
        (
            "telemetry.c",
            "    put(word & 0xFF);\n    put(word >> 8);",
            "    put(word >> 8);\n    put(word & 0xFF);",
        ),
    ),
    "a status that is read while busy": Named(
        ("P57", "read while busy (01h)"),
        (
            "telemetry.c",
            "    put(lm629_status(LEFT));\n    put(lm629_status(RIGHT));\n    put_word(position(LEFT));\n"
            "    put_word(position(RIGHT));",
            "    {\n        u16 l = position(LEFT), r = position(RIGHT);\n\n        put(lm629_status(LEFT));\n"
            "        put(lm629_status(RIGHT));\n        put_word(l);\n        put_word(r);\n    }",
        ),
    ),
    "a firmware that begins again every 100 ms": Named(
        ("begins again by itself: it reset its LM629s",),
        ("failsafe.c", "    ++ticks_taken;", "    if (++ticks_taken == 100)\n        ((void (*)(void))0)();"),
    ),
    "LM629s that are held in reset": Named(
        ("begin with P24: it holds its LM629s in reset",),
        ("lm629.c", "    LM629_RST = 1;\n    if (!boots", "    if (!boots"),
    ),
    "the other number of robots": Named(
        ("begin with P24: it obeys frames for 5 robots: its strap for N is read the other way",),
        ("decode.c", "STRAP_THREE ? 3 : 5", "STRAP_THREE ? 5 : 3"),
    ),
    "a filter that is not loaded": Named(
        ("P33", "no filter was loaded into its LM629 (LFIL, UDF)"),
        ("motion.c", "    load_filter();\n    load_acceleration();", "    load_acceleration();"),
    ),
    "service frames that are not fresh": Named(
        ("begin with P34", "the failsafe counts on from team frame, seq 21"),
        (
            "main.c",
            "if (decode_valid() && failsafe_fresh())",
            "if (decode_valid() && (HDR & TYPE_MASK) != TYPE_SERVICE && failsafe_fresh())",
        ),
    ),
    "changes the acceleration in motion": Named(("begin with P28", "an acceleration was loaded in motion")),
    "stays in an interrupt": Named(("begin with P52", "interrupts took all of 10 ms")),
    "a serial interrupt that is slow": Named(
        ("begin with P52", "interrupts took all of 10 ms"),
        (
            "uart.c",
            "            rx_mark[place] = mark;\n",
            "            rx_mark[place] = mark;\n            { u16 i; for (i = 0; i != 400; ++i) P1_7 = 1; }\n",
        ),
    ),
    "calls that are too deep for the stack": Named(
        ("begin with P53", "the stack runs into data, or leaves internal RAM"),
        (
            "main.c",
            "static void act(void)\n{\n",
            "static void deep(u8 n) __reentrant\n{\n    volatile u8 a[20];\n\n    a[0] = n;\n    if (n)\n"
            "        deep(n - 1);\n    a[1] = n;\n}\n\nstatic void act(void)\n{\n    deep(5);\n",
        ),
    ),
    "pushes for ever": Named(("begin with P53", "ran past the end of its stack")),
}
