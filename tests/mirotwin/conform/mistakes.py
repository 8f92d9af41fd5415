"""Mistakes to plant in the firmware's source, rules that each must fail, and what the command says of it."""

from typing import NamedTuple

from tests.mutants.planted import PLANTED


class Mistake(NamedTuple):
    """`right`, where it stands once in `file`, becomes `wrong`.

    `fails`: rules that must fail. `says`: words that the first three lines of `mirotwin conform` must have.
    """

    file: str
    right: str
    wrong: str
    fails: str = ""
    says: tuple[str, ...] = ()


_PLAIN = "because a plain team frame is not obeyed"
# fmt: off
_PLANTED = {
    "takes frames with a bad CRC": ("P07 P08 P30", ()),
    "acts on a frame that is repeated": (
        "P17 P18 P20 P21 P30", ("begin with P17", "0 steps on, seq 21 not acted on")),
    "takes the velocities of the robot before it": (
        "P22 P23", (_PLAIN, "these are the velocities of robot 0")),
    "stops 15 ms late": ("P29", ("begin with P29", "found left at 124.92 ms, right at 124.92 ms")),
    "stops 1 ms late": ("P29", ()),
    "stops 2 ms early": ("P29", ()),
    "changes the acceleration in motion": (
        "P37 P51", ("begin with P28", "an acceleration was loaded in motion")),
    "obeys service frames of other robots": ("P38", ()),
    "answers in another robot's turn": ("P41 P43", ()),
    "answers with another number": ("P41", ()),
    "tells what happened again and again": ("P45", ()),
    "writes while a chip is busy": ("P51", ()),
    "stays in an interrupt": ("P52", ("begin with P52", "interrupts took all of 10 ms")),
    "pushes for ever": ("P53", ("begin with P53", "ran past the end of its stack")),
    "drives backward velocities forward": ("", (_PLAIN, "the right one goes the wrong way")),
    "swaps the wheels": ("", (_PLAIN, "left and right are exchanged")),
    "begins the CRC without the layout byte": (
        "", (_PLAIN, "it obeys frames with another CRC (no layout byte)")),
    "does not whiten its answers": ("", ("begin with P42", "its HDR 96h is not whitened")),
    "never stops": ("", ("begin with P29", "found left not within 7")),
    "stops by opening the loops": (
        "", ("begin with P31", "wanted a smooth stop, found an order to the left wheel: off")),
    "never answers": ("", ("begin with P42", "wanted an answer to some of 9 questions in a row, found none")),
    "answers every question": (
        "", ("begin with P41", "is for robot 0", "an answer of robot 1 to question 60")),
}
"""Of mistakes that others look for too: `fails` and `says` by name."""
MISTAKES = {name: Mistake(*PLANTED[name][1:4], *told) for name, told in _PLANTED.items()} | {
    "a stop is sent while the motors are off": Mistake(
        "motion.c", "    if (state != STATE_DRIVING)\n        return;\n    watch_stopping();",
        "    watch_stopping();", "P01"),
    "one chip is reset once more, by command": Mistake(
        "lm629.c", "        if (handshake())\n            return true;",
        "        if (handshake()) {\n            selected = LEFT; lm629_command(0x00);\n"
        "            while (!boots(LEFT)); return true; }", "P02"),
    "leaves out RSTI": Mistake(
        "lm629.c",
        "    lm629_command(RSTI);\n    lm629_word(0, 0);\n    if (!free_to_go())\n        return false;\n",
        "    return true;\n", "P02"),
    "takes long to boot": Mistake(
        "main.c", "    decode_strap();",
        "    decode_strap();\n    { unsigned int i; for (i = 0; i != 30000; ++i) { P1_7 = 1; } }",
        "P03 P55 P56"),
    "wants FFh before the sync": Mistake(
        "decode.c", "    from = rx_taken - frame_size;",
        "    from = rx_taken - frame_size;\n"
        "    if (rx_character[RX_INDEX(from - 1)] != 0xFF) return false;", "P04"),
    "looks at the first sync byte only": Mistake(
        "decode.c", " && rx_character[RX_INDEX(from + 1)] == SYNC_1", "", "P05"),
    "looks at the second sync byte only": Mistake(
        "decode.c", "rx_character[RX_INDEX(from)] == SYNC_0 && ", "", "P05"),
    "takes the layout of 3 for its own": Mistake(
        "decode.c", "wire_start(robots == 3 ? CRC_START_RX3 : CRC_START_RX5);", "wire_start(CRC_START_RX3);",
        "P06 P23"),
    "looks at the low byte of the CRC only": Mistake(
        "decode.c", " && crc_high == CRC_RESIDUE >> 8", "", "P07"),
    "looks at the high byte of the CRC only": Mistake(
        "decode.c", "crc_low == (CRC_RESIDUE & 0xFF) && ", "", "P07"),
    "does not look at stop bits": Mistake("uart.c", "if (!RB8)", "if (0)", "P09"),
    "does not see a gap": Mistake("uart.c", "if (!TF0 && high == 0xFF && low", "if (low", "P10"),
    "does not see a long gap": Mistake("uart.c", "if (!TF0 && ", "if (", "P10"),
    "measures spacings too short": Mistake(
        "uart.c", "(65536UL - SPACING_MAX - 1 + RESTART_CYCLES)", "(65536UL - SPACING_MAX + 69)", "P11"),
    "leaves a frame in the window": Mistake(
        "decode.c", "    run = 0;\n    return true;", "    return true;", "P12"),
    "loses count after 256 characters": Mistake(
        "decode.c", "else if (run < RX_SIZE)\n        ++run;", "else\n        ++run;", "P13"),
    "starts again after a bad CRC": Mistake(
        "decode.c", "++frames_rejected;", "++frames_rejected; run = 0;", "P14"),
    "wants a pause before the preamble": Mistake(
        "decode.c", "    if (run < frame_size)", "    if (run != frame_size + RX3_PREAMBLE + 1)", "P04 P13"),
    "is deaf for a while after a bad stop bit": Mistake(
        "decode.c", "    if (run < frame_size)",
        "    {\n        static u8 deaf;\n        if (mark == MARK_DAMAGED)\n            deaf = 12;\n"
        "        else if (deaf) {\n            --deaf;\n            run = 0;\n        }\n    }\n"
        "    if (run < frame_size)", "P13 P15"),
    "takes 7 steps": Mistake(
        "failsafe.c", "step > FRESH_STEPS", "step >= FRESH_STEPS", "P16", ("P16", "team frame 8 steps on")),
    "takes 9 steps": Mistake("failsafe.c", "step > FRESH_STEPS", "step > FRESH_STEPS + 1", "P17"),
    "is deaf for 151 ms": Mistake(
        "failsafe.c", "    if (whole != FRESH_AGAIN_MS", "    ++whole;\n    if (whole != FRESH_AGAIN_MS",
        "P18"),
    "wants the first number to be no 0": Mistake("failsafe.c", "if (heard && (", "if ((", "P19"),
    "takes the same number again after a while": Mistake(
        "failsafe.c", "(!step || (step > FRESH_STEPS && !fresh_again()))",
        "((!step || step > FRESH_STEPS) && !fresh_again())", "P20"),
    "counts service frames by themselves": Mistake(
        "failsafe.c", "    last_hdr = HDR;", "    if ((HDR & TYPE_MASK) != TYPE_SERVICE) last_hdr = HDR;",
        "P21"),
    "does not move on a question": Mistake(
        "main.c", "        motion_team();\n        telemetry_answer();", "        telemetry_answer();",
        "P24"),
    "takes bytes the other way round": Mistake(
        "motion.c", "(int)((u16)PAYLOAD[at + 1] << 8 | PAYLOAD[at])",
        "(int)((u16)PAYLOAD[at] << 8 | PAYLOAD[at + 1])", "P25", (_PLAIN, "the bytes of each are exchanged")),
    "rounds the last bit": Mistake("motion.c", "    return velocity;", "    return velocity & ~1;", "P25"),
    "cuts off one too early": Mistake(
        "motion.c", "    if (velocity > VELOCITY_SATURATION)\n        return VELOCITY_SATURATION;",
        "    if (velocity > VELOCITY_SATURATION - 1)\n        return VELOCITY_SATURATION - 1;", "P26"),
    "does not cut off backwards": Mistake(
        "motion.c", "velocity < -VELOCITY_SATURATION", "velocity < -32767", "P26"),
    "starts one wheel after the other": Mistake(
        "motion.c", "    load_velocity(RIGHT, last_right);\n    start_both();",
        "    lm629_command(STT);\n    load_velocity(RIGHT, last_right);\n    lm629_command(STT);", "P27"),
    "stops after 40 ms": Mistake("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == 40)", "P28 P29"),
    "puts the failsafe off by frames that are not fresh": Mistake(
        "failsafe.c", "        ++frames_stale;", "        ++frames_stale; restart();", "P30"),
    "stops abruptly": Mistake("motion.c", "halt_both(TRJ_SMOOTH_STOP);", "halt_both(0x02);", "P31"),
    "stops with another acceleration": Mistake(
        "motion.c", "HIGH(DEFAULT_ACCELERATION), 0, 0};", "HIGH(DEFAULT_ACCELERATION) + 1, 0, 0};", "P31"),
    "goes off after 501 ms": Mistake(
        "failsafe.c", "age == FAILSAFE_OFF_MS)", "age == FAILSAFE_OFF_MS + 1)", "P32"),
    "never goes off": Mistake(
        "failsafe.c", "        motion_off();\n", "", "P30 P32",
        ("begin with P32", "found left not within 734.88 ms")),
    "stays off": Mistake(
        "motion.c", "    if (slot >= robots)\n        return;",
        "    if (slot >= robots || (failsafe_flags & FLAG_MOTORS_OFF && last_left))\n        return;", "P33"),
    "stops on a service frame": Mistake(
        "main.c", "        motion_service();", "        motion_stop();", "P34 P35"),
    "loads kd twice": Mistake(
        "motion.c", "lm629_word(filter[i + 1], filter[i]);", "lm629_word(filter[5], filter[4]);", "P35"),
    "forgets UDF": Mistake("motion.c", "    lm629_command(UDF);\n", "", "P35"),
    "takes 16 bits of an acceleration": Mistake(
        "motion.c", "    lm629_word(acceleration[3], acceleration[2]);", "    lm629_word(0, 0);", "P36"),
    "stops while an acceleration waits and one wheel stands": Mistake(
        "motion.c", "acceleration_waits && !last_left && !last_right", "acceleration_waits && !last_left",
        "P37"),
    "loads an acceleration when one wheel stands": Mistake(
        "watch.c", "on_target(LEFT) && on_target(RIGHT)", "on_target(LEFT)", "P37"),
    "forgets an acceleration that waits": Mistake(
        "motion.c", "        acceleration_waits = 1;", "        acceleration_waits = state != STATE_DRIVING;",
        "P37"),
    "takes an unknown opcode for an acceleration": Mistake(
        "motion.c", "    case OPCODE_ACCELERATION:",
        "    default:\n        if (!PAYLOAD[SERVICE_OPCODE]) break;", "P39"),
    "takes type 2 for a question": Mistake(
        "main.c", "    case TYPE_TEAM_ASK:", "    case TYPE_TELEMETRY:\n    case TYPE_TEAM_ASK:", "P40"),
    "leaves out FFh": Mistake(
        "telemetry.c", "tx_frame[TX_PREAMBLE] = PREAMBLE_LAST;", "tx_frame[TX_PREAMBLE] = PREAMBLE_BYTE;",
        "P42"),
    "answers unasked": Mistake(
        "main.c", "        motion_service();", "        motion_service();\n        telemetry_answer();",
        "P43"),
    "begins a new answer in the middle of one": Mistake(
        "telemetry.c", "seq % robots != slot || tx_busy", "seq % robots != slot", "P44"),
    "never says that it stopped": Mistake(
        "failsafe.c", "        failsafe_flags |= FLAG_STOPPED;\n", "", "P45"),
    "says the left status twice": Mistake(
        "telemetry.c", "put(lm629_status(RIGHT));", "put(lm629_status(LEFT));", "P46"),
    "says desired positions": Mistake(
        "lm629.h", "#define RDRP            0x0A", "#define RDRP            0x08", "P47"),
    "says the high words of positions": Mistake(
        "telemetry.c", "    lm629_read_word();\n    return lm629_read_word();",
        "    return lm629_read_word();", "P47"),
    "counts valid frames as accepted": Mistake(
        "failsafe.c", "        ++frames_stale;", "        ++frames_accepted;", "P48"),
    "stops counting at 255": Mistake(
        "failsafe.c", "    ++frames_accepted;", "    if (frames_accepted != 255) ++frames_accepted;", "P48"),
    "does not count rejected frames": Mistake("decode.c", "++frames_rejected;", ";", "P49"),
    "is mute once its motors are off": Mistake(
        "telemetry.c", "seq % robots != slot || tx_busy",
        "seq % robots != slot || tx_busy || failsafe_flags & 0x18", "P50"),
    "executes A5h": Mistake(
        "main.c", "    EA = 1;", "    __asm\n    .db 0xA5\n    __endasm;\n    EA = 1;", "P54"),
    "asks the chips while characters wait": Mistake("motion.c", " || rx_taken != rx_count", "", "P30"),
    "sets a mask by RSTI": Mistake(
        "lm629.c", "    lm629_word(0, 0);\n    if", "    lm629_word(0xFF, 0);\n    if", "P02"),
    "waits 65 us for a busy chip": Mistake("lm629.c", "BUSY_POLLS      25", "BUSY_POLLS      4", "P57"),
    "waits 0.85 ms for a chip to come up": Mistake(
        "lm629.c", "BOOT_POLLS      200", "BOOT_POLLS      50", "P57"),
    "takes 80h alone after RSTI": Mistake(
        "lm629.c", "(lm629_status(LEFT) & ~STATUS_BIT6) == STATUS_READY", "lm629_status(LEFT) == STATUS_READY",
        "P57"),
    "says nothing of a chip that does not come up": Mistake(
        "telemetry.c", " | (lm629_ready ? 0 : FLAG_INIT_FAILED)", "", "P58"),
    "waits for ever for a chip to come up": Mistake(
        "lm629.c", "        if (!--polls)\n            return false;", "        ;", "P58"),
    "tells positions of two samples": Mistake(
        "telemetry.c", "    put_word(position(LEFT));\n    put_word(position(RIGHT));",
        "    put(position(LEFT) & 0xFF);\n    put(position(LEFT) >> 8);\n    put_word(position(RIGHT));",
        "P47"),
    "forgets its flags where others are asked": Mistake(
        "telemetry.c", "    if (seq % robots != slot || tx_busy)\n        return;",
        "    if (seq % robots != slot || tx_busy) {\n        failsafe_flags = 0;\n        return;\n    }",
        "P45"),
    "waits for ever for a busy chip": Mistake(
        "lm629.c", "        if (!--polls) {\n", "        if (0) {\n            --polls;\n", "P59"),
    "moves in a slot that is not there": Mistake(
        "motion.c", "    if (slot >= robots)\n        return;\n", "", "P60"),
    "does not watch the position error": Mistake(
        "watch.c",
        "    lm629_command(LPES);\n    lm629_word(POSITION_ERROR_MAX >> 8, POSITION_ERROR_MAX & 0xFF);\n", "", "P63"),
    "leaves the other wheel on": Mistake("motion.c", "    motion_off();\n    lost =", "    lost =", "P63"),
    "drives on after a lost wheel": Mistake(
        "motion.c", "    if (last_left || last_right)\n        return false;\n", "", "P63"),
    "never drives again after a lost wheel": Mistake(
        "motion.c", "    if (last_left || last_right)\n", "    if (1)\n", "P64"),
    "clears the error that it should tell of": Mistake(
        "motion.c", "    motion_off();\n    lost =",
        "    motion_off();\n    lm629_select(BOTH);\n    lm629_command(RSTI);\n    lm629_word(0, 0);\n    lost =",
        "P64"),
    "hangs after 1000 frames": Mistake(
        "failsafe.c", "    ++frames_accepted;",
        "    if (++frames_accepted == 1000)\n        for (;;)\n            ;", "P61"),
    "says nothing of power-on": Mistake("motion.c", "    failsafe_flags |= FLAG_MOTORS_OFF;\n", "", "P45"),
    "lets the age begin again": Mistake(
        "failsafe.c", "    if (age != AGE_MAX)\n        ++age;", "    ++age;", "P62"),
    "the sign of both": Mistake(
        "motion.c", "    u16 speed = velocity;\n",
        "    u16 speed;\n\n    velocity = -velocity;\n    speed = velocity;\n",
        says=(_PLAIN, "begin with P24", "found -978 (FC2Eh), 983 (03D7h)",
              "the signs of both are turned over")),
    "twice the velocity": Mistake(
        "motion.c", "    lm629_word(0, HIGH(speed));\n    lm629_word(LOW(speed), 0);",
        "    speed <<= 1;\n    lm629_word(0, HIGH(speed));\n    lm629_word(LOW(speed), 0);",
        says=(_PLAIN, "2 times as fast")),
    "velocities that are not started": Mistake(
        "motion.c", "    lm629_command(STT);\n", "", says=(_PLAIN, "loaded, but not started (STT)")),
    "a CRC that begins with 0": Mistake(
        "wire.c", "    crc_low = crc & 0xFF;\n    crc_high = crc >> 8;", "    crc_low = crc_high = 0;",
        says=(_PLAIN, "0000h and not FFFFh at the start")),
    "a CRC without the last XOR": Mistake(
        "decode.c", "return crc_low == (CRC_RESIDUE & 0xFF) && crc_high == CRC_RESIDUE >> 8;",
        "return !crc_low && !crc_high;",
        says=(_PLAIN, "it obeys frames with another CRC (no XOR with FFFFh at the end)")),
    "whitening that begins late": Mistake(
        "wire.c", "    at = 0;", "    at = 1;",
        says=(_PLAIN, "whitening that begins with the second byte of its string")),
    "no whitening": Mistake(
        "wire.c", "value ^ whitening[at++]", "value", says=(_PLAIN, "it obeys frames with no whitening")),
    "the high byte of the answer's CRC first": Mistake(
        "telemetry.c", "    tx_frame[at++] = wire_whiten(low);\n    tx_frame[at] = wire_whiten(high);",
        "    tx_frame[at++] = wire_whiten(high);\n    tx_frame[at] = wire_whiten(low);",
        says=("begin with P42", "high byte sent first")),
    "a reload of the bit rate that is off by one": Mistake(
        "uart.c", "    RCAP2L = TIMER2_RELOAD_LOW;\n", "    RCAP2L = TIMER2_RELOAD_LOW + 1;\n",
        says=("begin with P42", "at 9615 baud", "9740 baud")),
    "half the bit rate": Mistake(
        "uart.c", "    RCAP2L = TIMER2_RELOAD_LOW;\n", "    RCAP2L = TIMER2_RELOAD_LOW - 78;\n",
        says=(_PLAIN, "its serial port takes 7 of 23 characters")),
    "stops after 100 ms": Mistake(
        "failsafe.c", "age == FAILSAFE_STOP_MS)", "age == 100)",
        says=("begin with P29", "found the left one 99.92 ms after it")),
    "answers that come late": Mistake(
        "telemetry.c", "    begin();\n    put(TYPE",
        "    { u16 i; for (i = 0; i != 6000; ++i) { P1_7 = 1; } }\n    begin();\n    put(TYPE",
        says=("begin with P41", "found one that is over 40.98 ms after the question's end")),
    "positions of the other wheel": Mistake(
        "telemetry.c", "    put_word(position(LEFT));\n    put_word(position(RIGHT));",
        "    put_word(position(RIGHT));\n    put_word(position(LEFT));",
        says=("begin with P47", "that is the other wheel's")),
    "positions with the high byte first": Mistake(
        "telemetry.c", "    put(word & 0xFF);\n    put(word >> 8);",
        "    put(word >> 8);\n    put(word & 0xFF);", says=("begin with P47", "its bytes are exchanged")),
    "a status that is read while busy": Mistake(
        "telemetry.c",
        "    put(lm629_status(LEFT));\n    put(lm629_status(RIGHT));\n    put_word(position(LEFT));\n"
        "    put_word(position(RIGHT));",
        "    {\n        u16 l = position(LEFT), r = position(RIGHT);\n\n"
        "        put(lm629_status(LEFT));\n        put(lm629_status(RIGHT));\n        put_word(l);\n"
        "        put_word(r);\n    }", says=("P57", "read while busy (01h)")),
    "a firmware that begins again every 100 ms": Mistake(
        "failsafe.c", "    ++ticks_taken;", "    if (++ticks_taken == 100)\n        ((void (*)(void))0)();",
        says=("resets unexpectedly: it reset its LM629s",)),
    "LM629s that are held in reset": Mistake(
        "lm629.c", "    LM629_RST = 1;\n    if (!boots", "    if (!boots",
        says=("begin with P24: it holds its LM629s in reset",)),
    "the other number of robots": Mistake(
        "decode.c", "STRAP_THREE ? 3 : 5", "STRAP_THREE ? 5 : 3",
        says=("begin with P24: it obeys frames for 5 robots: its strap for N is read the other way",)),
    "a filter that is not loaded": Mistake(
        "motion.c", "    load_filter();\n    load_acceleration();", "    load_acceleration();",
        says=("begin with P24", "no filter was loaded into its LM629 (LFIL, UDF)")),
    "service frames that are not fresh": Mistake(
        "main.c", "if (decode_valid() && failsafe_fresh())",
        "if (decode_valid() && (HDR & TYPE_MASK) != TYPE_SERVICE && failsafe_fresh())",
        says=("begin with P34", "the failsafe counts on from team frame, seq 21")),
    "a serial interrupt that is slow": Mistake(
        "uart.c", "            rx_mark[place] = mark;\n",
        "            rx_mark[place] = mark;\n"
        "            { u16 i; for (i = 0; i != 400; ++i) P1_7 = 1; }\n",
        says=("begin with P52", "interrupts took all of 10 ms")),
    "calls that are too deep for the stack": Mistake(
        "main.c", "static void act(void)\n{\n",
        "static void deep(u8 n) __reentrant\n{\n    volatile u8 a[20];\n\n    a[0] = n;\n    if (n)\n"
        "        deep(n - 1);\n    a[1] = n;\n}\n\nstatic void act(void)\n{\n    deep(5);\n",
        says=("begin with P53", "the stack runs into data, or leaves internal RAM")),
}
# fmt: on
