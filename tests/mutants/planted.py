"""Mistakes that people make in such firmware, each planted by hand: one text of one file becomes another one."""

from typing import NamedTuple


class Planted(NamedTuple):
    """`right`, which stands once in `file`, becomes `wrong`; `breaks` says what the firmware then does."""

    name: str
    file: str
    right: str
    wrong: str
    breaks: str

    def applied(self, source):
        """The file's text with the mistake. ValueError unless the right text stands there once."""
        count = source.count(self.right)
        if count != 1:
            raise ValueError(f"{self.name}: {self.file} has {count} times {self.right!r}, wanted once")
        return source.replace(self.right, self.wrong)


_FAILSAFE = (
    Planted(
        "stops 15 ms late",
        *("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 15)"),
        "The smooth stop comes 125 ms after the last fresh frame.",
    ),
    Planted(
        "stops 1 ms late",
        *("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 1)"),
        "The smooth stop comes after 111 ms.",
    ),
    Planted(
        "stops 2 ms early",
        *("failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS - 2)"),
        "The smooth stop comes after 108 ms, early even for a robot that counts from the start of a character.",
    ),
    Planted(
        "never stops",
        *("failsafe.c", "        motion_stop();\n", ""),
        "Without frames the wheels go on until the motors go off.",
    ),
    Planted(
        "stops by opening the loops",
        *("failsafe.c", "        motion_stop();\n", "        motion_off();\n"),
        "After 110 ms the motors go off at once, and the robot rolls on.",
    ),
    Planted(
        "goes off 100 ms late",
        *("failsafe.c", "age == FAILSAFE_OFF_MS)", "age == FAILSAFE_OFF_MS + 100)"),
        "The motors go off after 600 ms.",
    ),
    Planted(
        "goes off 20 ms late",
        *("failsafe.c", "age == FAILSAFE_OFF_MS)", "age == FAILSAFE_OFF_MS + 20)"),
        "The motors go off after 520 ms.",
    ),
    Planted(
        "stale frames feed the failsafe",
        *("failsafe.c", "        ++frames_stale;\n", "        ++frames_stale;\n        restart();\n"),
        "A host that repeats one frame for ever keeps the robot going.",
    ),
    Planted(
        "garbage feeds the failsafe",
        "main.c",
        """            if (decode_character()) {
""",
        """            if (!decode_character())
                failsafe_start();
            else {
""",
        "Any character restarts the failsafe.",
    ),
    Planted(
        "milliseconds that come together count once",
        *("failsafe.c", "    ++ticks_taken;\n", "    ticks_taken = ticks;\n"),
        "The interrupt runs ahead of the main loop while that answers; what was counted twice is looked at once.",
    ),
)
_FRESHNESS = (
    Planted(
        "acts on a frame that is repeated",
        *("failsafe.c", "if (heard && (", "if (0 && ("),
        "Every valid frame counts as fresh.",
    ),
    Planted(
        "takes step 0 for fresh",
        *(
            "failsafe.c",
            "(!step || (step > FRESH_STEPS && !fresh_again()))",
            "step > FRESH_STEPS && !fresh_again()",
        ),
        "A frame with the number of the last one is fresh.",
    ),
    Planted(
        "takes any other step for fresh",
        *("failsafe.c", "step > FRESH_STEPS &&", "step > 63 &&"),
        "Frames that overtook each other are obeyed.",
    ),
    Planted(
        "never takes an old host back",
        *("failsafe.c", "!fresh_again()", "1"),
        "150 ms after the last fresh frame another number is still stale.",
    ),
    Planted(
        "takes a host back after 160 ms",
        "failsafe.c",
        """    if (whole != FRESH_AGAIN_MS)
        return whole > FRESH_AGAIN_MS;
""",
        """    if (whole != FRESH_AGAIN_MS + 10)
        return whole > FRESH_AGAIN_MS + 10;
""",
        "Other numbers become fresh 10 ms late.",
    ),
    Planted(
        "keeps its memory over a reset",
        "main.c",
        "void main(void)\n{\n",
        """static __idata u8 warm;

unsigned char _sdcc_external_startup(void)
{
    return warm == 0x5A;
}

void main(void)
{
    warm = 0x5A;
""",
        "After the reset pin the first frame is judged by the number of the last one before.",
    ),
)
_RECEPTION = (
    Planted(
        "takes frames with a bad CRC",
        *(
            "decode.c",
            "if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {",
            "take_body(rx_taken - frame_size + RX3_AT_HDR); if (0) {",
        ),
        "What noise has changed is obeyed.",
    ),
    Planted(
        "begins the CRC without the layout byte",
        *("decode.c", "wire_start(robots == 3 ? CRC_START_RX3 : CRC_START_RX5);", "wire_start(0xFFFF);"),
        "Frames with another CRC are valid, and those of the host are not.",
    ),
    Planted(
        "takes frames of another layout too",
        "decode.c",
        "    if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {\n",
        """    robots ^= 3 ^ 5;
    if (take_body(rx_taken - frame_size + RX3_AT_HDR)) {
        robots ^= 3 ^ 5;
        run = 0;
        return true;
    }
    robots ^= 3 ^ 5;
    if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {
""",
        "A frame whose CRC began with the layout byte of the other network is valid.",
    ),
    Planted(
        "looks at one character less",
        *("decode.c", "    if (run < frame_size)\n", "    if (run < frame_size - 1)\n"),
        "The stop bit of a frame's first character, or a gap behind it, does not matter.",
    ),
    Planted(
        "does not empty the window",
        *("decode.c", "    run = 0;\n    return true;\n", "    return true;\n"),
        "A frame that lies partly in a valid one is valid as well.",
    ),
    Planted(
        "does not look at spacings",
        "uart.c",
        "else if (!TF0 && high == 0xFF && low >= 0xFF - (SPACING_MAX - SPACING_MIN))",
        "else",
        "Frames with gaps in them are valid.",
    ),
    Planted(
        "takes gaps of 90 us",
        *("uart.c", "(65536UL - SPACING_MAX - 1 +", "(65536UL - SPACING_MAX - 90 - 1 +"),
        "Characters may begin 1135 us after each other instead of 1090, and not less than 1035.",
    ),
    Planted(
        "takes bad stop bits",
        *("uart.c", "            if (!RB8)\n", "            if (0)\n"),
        "A character whose stop bit was 0 is like any other.",
    ),
    Planted(
        "loses sync for good after a bad CRC",
        *("decode.c", "++frames_rejected;", "++frames_rejected; frame_size = 99;"),
        "After one damaged frame nothing is valid any more.",
    ),
    Planted(
        "does not count damaged frames",
        *("decode.c", "        ++frames_rejected;\n", ""),
        "The counter of rejected frames stays at 0.",
    ),
    Planted(
        "counts stale frames as accepted",
        *("failsafe.c", "        ++frames_stale;\n", "        ++frames_stale;\n        ++frames_accepted;\n"),
        "The counter of accepted frames runs ahead.",
    ),
)
_WHEELS = (
    Planted(
        "takes the velocities of the robot before it",
        *("motion.c", "u8 at = slot * PAIR_SIZE;", "u8 at = (slot - 1) * PAIR_SIZE;"),
        "Each robot does what another one is told.",
    ),
    Planted(
        "does not cut off",
        *("motion.c", "velocity > VELOCITY_SATURATION)", "velocity > 32767)"),
        "Forward velocities above 16633 reach the wheels.",
    ),
    Planted(
        "does not cut off backwards",
        *("motion.c", "velocity < -VELOCITY_SATURATION)", "velocity < -32767)"),
        "Backward velocities beyond -16633 reach the wheels.",
    ),
    Planted(
        "compares velocities without their sign",
        *("motion.c", "velocity > VELOCITY_SATURATION)", "(u16)velocity > VELOCITY_SATURATION)"),
        "Backward becomes full speed ahead.",
    ),
    Planted(
        "drives backward velocities forward",
        *("motion.c", "        mode = TRJ_VELOCITY;\n", ""),
        "The sign of a velocity is lost.",
    ),
    Planted(
        "swaps the wheels",
        "motion.c",
        "    load_velocity(LEFT, last_left);\n    load_velocity(RIGHT, last_right);\n",
        "    load_velocity(LEFT, last_right);\n    load_velocity(RIGHT, last_left);\n",
        "The robot turns to the other side.",
    ),
    Planted(
        "starts the wheels one by one",
        "motion.c",
        "    load_velocity(LEFT, last_left);\n    load_velocity(RIGHT, last_right);\n    start_both();\n",
        """    load_velocity(LEFT, last_left);
    lm629_command(STT);
    load_velocity(RIGHT, last_right);
    lm629_command(STT);
""",
        "The two wheels take their velocities in different samples.",
    ),
)
_SERVICE = (
    Planted(
        "obeys service frames of other robots",
        *("motion.c", "    if (PAYLOAD[SERVICE_SLOT] != slot)\n        return;\n", ""),
        "One robot's gains change those of all.",
    ),
    Planted(
        "acts on opcodes that it does not know",
        *("motion.c", "    case OPCODE_FILTER:\n", "    default:\n    case OPCODE_FILTER:\n"),
        "A ping sets all gains to 0.",
    ),
    Planted(
        "stops for a service frame",
        *("main.c", "        motion_service();\n", "        motion_stop();\n        motion_service();\n"),
        "The wheels do not keep their velocities.",
    ),
    Planted(
        "drives by a frame of type 2",
        *("main.c", "    case TYPE_TEAM:\n", "    case TYPE_TELEMETRY:\n    case TYPE_TEAM:\n"),
        "A type that no host sends moves the wheels.",
    ),
    Planted(
        "changes the acceleration in motion",
        *(
            "motion.c",
            "    if (!acceleration_waits || state == STATE_DRIVING || rx_taken != rx_count)\n        return;",
            "",
        ),
        "The LM629 refuses the STT that follows.",
    ),
)
_ANSWERS = (
    Planted(
        "never answers",
        *("telemetry.c", "seq % robots != slot || tx_busy", "1"),
        "Questions stay without an answer.",
    ),
    Planted(
        "answers every question",
        *("telemetry.c", "seq % robots != slot || tx_busy", "tx_busy"),
        "All robots of a network speak at once.",
    ),
    Planted(
        "answers in another robot's turn",
        *("telemetry.c", "seq % robots != slot", "seq % robots == 2"),
        "The wrong robot answers.",
    ),
    Planted(
        "answers frames that ask nobody",
        *(
            "main.c",
            "        motion_team();\n        break;\n    case TYPE_TEAM_ASK:\n",
            "    case TYPE_TEAM_ASK:\n",
        ),
        "A frame of type 0 is answered as one of type 3.",
    ),
    Planted(
        "answers with another number",
        *("telemetry.c", "put(TYPE_TELEMETRY | seq);", "put(TYPE_TELEMETRY | ((seq + 1) & 0x3F));"),
        "The answer does not carry the question's number.",
    ),
    Planted(
        "does not whiten its answers",
        *("wire.c", "    return wire_whiten(clear);\n", "    return clear;\n"),
        "HDR and payload of an answer go out in clear.",
    ),
    Planted(
        "tells the upper half of positions",
        *(
            "telemetry.c",
            "    lm629_read_word();\n    return lm629_read_word();\n",
            "    return lm629_read_word();\n",
        ),
        "The low word of the position is missing.",
    ),
    Planted(
        "tells what happened again and again",
        *("telemetry.c", "    failsafe_flags = 0;\n", ""),
        "A flag that was told once stays in all answers.",
    ),
)
_CHIP = (
    Planted(
        "writes while a chip is busy",
        *("lm629.c", "write_cycle(opcode);", "write_cycle(opcode); write_cycle(opcode);"),
        "An LM629 loses what is written to it while it is busy.",
    ),
    Planted(
        "stays in an interrupt",
        *("failsafe.c", "    ++ticks;\n    sleep = 0;", "    for (;;) ++ticks;"),
        "The main loop stands still.",
    ),
    Planted(
        "pushes for ever",
        *("main.c", "    EA = 1;", "    __asm\n    00999$: push acc\n    sjmp 00999$\n    __endasm;"),
        "The stack goes over the end of internal RAM.",
    ),
)
PLANTED = {
    one.name: one for one in (*_FAILSAFE, *_FRESHNESS, *_RECEPTION, *_WHEELS, *_SERVICE, *_ANSWERS, *_CHIP)
}
