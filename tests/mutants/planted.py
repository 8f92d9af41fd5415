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


# Name and what it breaks, then file, right text and wrong text.
# fmt: off
_TABLE = (
    # failsafe
    ("stops 15 ms late", "The smooth stop comes 125 ms after the last fresh frame.",
     "failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 15)"),
    ("stops 1 ms late", "The smooth stop comes after 111 ms.",
     "failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS + 1)"),
    ("stops 2 ms early",
     "The smooth stop comes after 108 ms, early even for a robot that counts from the start of a character.",
     "failsafe.c", "age == FAILSAFE_STOP_MS)", "age == FAILSAFE_STOP_MS - 2)"),
    ("never stops", "Without frames the wheels go on until the motors go off.",
     "failsafe.c", "        motion_stop();\n", ""),
    ("stops by opening the loops", "After 110 ms the motors go off at once, and the robot rolls on.",
     "failsafe.c", "        motion_stop();\n", "        motion_off();\n"),
    ("goes off 100 ms late", "The motors go off after 600 ms.",
     "failsafe.c", "age == FAILSAFE_OFF_MS)", "age == FAILSAFE_OFF_MS + 100)"),
    ("goes off 20 ms late", "The motors go off after 520 ms.",
     "failsafe.c", "age == FAILSAFE_OFF_MS)", "age == FAILSAFE_OFF_MS + 20)"),
    ("stale frames feed the failsafe", "A host that repeats one frame for ever keeps the robot going.",
     "failsafe.c", "        ++frames_stale;\n", "        ++frames_stale;\n        restart();\n"),
    ("garbage feeds the failsafe", "Any character restarts the failsafe.",
     "main.c", "            if (decode_character()) {\n",
     """            if (!decode_character())
                failsafe_start();
            else {
"""),
    ("milliseconds that come together count once",
     "The interrupt runs ahead of the main loop while that answers; what was counted twice is looked at once.",
     "failsafe.c", "    ++ticks_taken;\n", "    ticks_taken = ticks;\n"),
    # freshness
    ("acts on a frame that is repeated", "Every valid frame counts as fresh.",
     "failsafe.c", "if (heard && (", "if (0 && ("),
    ("takes step 0 for fresh", "A frame with the number of the last one is fresh.",
     "failsafe.c", "(!step || (step > FRESH_STEPS && !fresh_again()))", "step > FRESH_STEPS && !fresh_again()"),
    ("takes any other step for fresh", "Frames that overtook each other are obeyed.",
     "failsafe.c", "step > FRESH_STEPS &&", "step > 63 &&"),
    ("never takes an old host back", "150 ms after the last fresh frame another number is still stale.",
     "failsafe.c", "!fresh_again()", "1"),
    ("takes a host back after 160 ms", "Other numbers become fresh 10 ms late.",
     "failsafe.c", "    if (whole != FRESH_AGAIN_MS)\n        return whole > FRESH_AGAIN_MS;\n",
     "    if (whole != FRESH_AGAIN_MS + 10)\n        return whole > FRESH_AGAIN_MS + 10;\n"),
    ("keeps its memory over a reset",
     "After the reset pin the first frame is judged by the number of the last one before.",
     "main.c", "void main(void)\n{\n",
     """static __idata u8 warm;

unsigned char _sdcc_external_startup(void)
{
    return warm == 0x5A;
}

void main(void)
{
    warm = 0x5A;
"""),
    # reception
    ("takes frames with a bad CRC", "What noise has changed is obeyed.",
     "decode.c", "if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {",
     "take_body(rx_taken - frame_size + RX3_AT_HDR); if (0) {"),
    ("begins the CRC without the layout byte",
     "Frames with another CRC are valid, and those of the host are not.",
     "decode.c", "wire_start(robots == 3 ? CRC_START_RX3 : CRC_START_RX5);", "wire_start(0xFFFF);"),
    ("takes frames of another layout too",
     "A frame whose CRC began with the layout byte of the other network is valid.",
     "decode.c", "    if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {\n",
     """    robots ^= 3 ^ 5;
    if (take_body(rx_taken - frame_size + RX3_AT_HDR)) {
        robots ^= 3 ^ 5;
        run = 0;
        return true;
    }
    robots ^= 3 ^ 5;
    if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {
"""),
    ("looks at one character less",
     "The stop bit of a frame's first character, or a gap behind it, does not matter.",
     "decode.c", "    if (run < frame_size)\n", "    if (run < frame_size - 1)\n"),
    ("does not empty the window", "A frame that lies partly in a valid one is valid as well.",
     "decode.c", "    run = 0;\n    return true;\n", "    return true;\n"),
    ("does not look at spacings", "Frames with gaps in them are valid.",
     "uart.c", "else if (!TF0 && high == 0xFF && low >= 0xFF - (SPACING_MAX - SPACING_MIN))", "else"),
    ("takes gaps of 90 us",
     "Characters may begin 1135 us after each other instead of 1090, and not less than 1035.",
     "uart.c", "(65536UL - SPACING_MAX - 1 +", "(65536UL - SPACING_MAX - 90 - 1 +"),
    ("takes bad stop bits", "A character whose stop bit was 0 is like any other.",
     "uart.c", "            if (!RB8)\n", "            if (0)\n"),
    ("loses sync for good after a bad CRC", "After one damaged frame nothing is valid any more.",
     "decode.c", "if (!take_body(", "if (frames_rejected || !take_body("),
    ("does not count damaged frames", "The counter of rejected frames stays at 0.",
     "decode.c", "        ++frames_rejected;\n", ""),
    ("counts stale frames as accepted", "The counter of accepted frames runs ahead.",
     "failsafe.c", "        ++frames_stale;\n", "        ++frames_stale;\n        ++frames_accepted;\n"),
    # wheels
    ("takes the velocities of the robot before it", "Each robot does what another one is told.",
     "motion.c", "u8 at = slot * PAIR_SIZE;", "u8 at = (slot - 1) * PAIR_SIZE;"),
    ("does not cut off", "Forward velocities above 16633 reach the wheels.",
     "motion.c", "velocity > VELOCITY_SATURATION)", "velocity > 32767)"),
    ("does not cut off backwards", "Backward velocities beyond -16633 reach the wheels.",
     "motion.c", "velocity < -VELOCITY_SATURATION)", "velocity < -32767)"),
    ("compares velocities without their sign", "Backward becomes full speed ahead.",
     "motion.c", "velocity > VELOCITY_SATURATION)", "(u16)velocity > VELOCITY_SATURATION)"),
    ("drives backward velocities forward", "The sign of a velocity is lost.",
     "motion.c", "        mode = TRJ_VELOCITY;\n", ""),
    ("swaps the wheels", "The robot turns to the other side.",
     "motion.c", "    load_velocity(LEFT, last_left);\n    load_velocity(RIGHT, last_right);\n",
     "    load_velocity(LEFT, last_right);\n    load_velocity(RIGHT, last_left);\n"),
    ("starts the wheels one by one", "The two wheels take their velocities in different samples.",
     "motion.c",
     """    load_velocity(LEFT, last_left);
    load_velocity(RIGHT, last_right);
    start_both();
""",
     """    load_velocity(LEFT, last_left);
    lm629_command(STT);
    load_velocity(RIGHT, last_right);
    lm629_command(STT);
"""),
    # service
    ("obeys service frames of other robots", "One robot's gains change those of all.",
     "motion.c", "    if (PAYLOAD[SERVICE_SLOT] != slot)\n        return;\n", ""),
    ("acts on opcodes that it does not know", "A ping sets all gains to 0.",
     "motion.c", "    case OPCODE_FILTER:\n", "    default:\n    case OPCODE_FILTER:\n"),
    ("stops for a service frame", "The wheels do not keep their velocities.",
     "main.c", "        motion_service();\n", "        motion_stop();\n        motion_service();\n"),
    ("drives by a frame of type 2", "A type that no host sends moves the wheels.",
     "main.c", "    case TYPE_TEAM:\n", "    case TYPE_TELEMETRY:\n    case TYPE_TEAM:\n"),
    ("changes the acceleration in motion", "The LM629 refuses the STT that follows.",
     "motion.c",
     "    if (!acceleration_waits || state == STATE_DRIVING || rx_taken != rx_count)\n        return;", ""),
    # answers
    ("never answers", "Questions stay without an answer.",
     "telemetry.c", "seq % robots != slot || tx_busy", "1"),
    ("answers every question", "All robots of a network speak at once.",
     "telemetry.c", "seq % robots != slot || tx_busy", "tx_busy"),
    ("answers in another robot's turn", "The wrong robot answers.",
     "telemetry.c", "seq % robots != slot", "seq % robots == 2"),
    ("answers frames that ask nobody", "A frame of type 0 is answered as one of type 3.",
     "main.c",
     """        motion_team();
        break;
    case TYPE_TEAM_ASK:
""",
     "    case TYPE_TEAM_ASK:\n"),
    ("answers with another number", "The answer does not carry the question's number.",
     "telemetry.c", "put(TYPE_TELEMETRY | seq);", "put(TYPE_TELEMETRY | ((seq + 1) & 0x3F));"),
    ("does not whiten its answers", "HDR and payload of an answer go out in clear.",
     "wire.c", "    return wire_whiten(clear);\n", "    return clear;\n"),
    ("tells the upper half of positions", "The low word of the position is missing.",
     "telemetry.c", "    lm629_read_word();\n    return lm629_read_word();\n",
     "    return lm629_read_word();\n"),
    ("tells what happened again and again", "A flag that was told once stays in all answers.",
     "telemetry.c", "    failsafe_flags = 0;\n", ""),
    # chip
    ("writes while a chip is busy", "An LM629 loses what is written to it while it is busy.",
     "lm629.c", "write_cycle(opcode);", "write_cycle(opcode); write_cycle(opcode);"),
    ("stays in an interrupt", "The main loop stands still.",
     "failsafe.c", "    ++ticks;\n    sleep = 0;", "    for (;;) ++ticks;"),
    ("pushes for ever", "The stack goes over the end of internal RAM.",
     "main.c", "    EA = 1;",
     """    __asm
    00999$: push acc
    sjmp 00999$
    __endasm;"""),
)
# fmt: on
PLANTED = {name: Planted(name, *change, breaks) for name, breaks, *change in _TABLE}
