"""Mistakes that a fuzzer has to find: each needs an input that a bench hardly sends."""

from typing import NamedTuple

from tests.mutants.planted import PLANTED, Planted


class ForFuzzing(NamedTuple):
    """`changes` are made together; `check` is the check of a run that fails; `needs`: the input that shows it."""

    name: str
    check: str
    changes: tuple[tuple[str, str, str], ...]
    breaks: str
    needs: str

    def applied(self, sources):
        """The texts of the files that the mistake changes. ValueError as `Planted.applied`."""
        changed = {}
        for file, right, wrong in self.changes:
            before = changed.get(file, sources[file])
            changed[file] = Planted(self.name, file, right, wrong, self.breaks).applied(before)
        return changed


def _mistake(name, check, *rest):
    if name in PLANTED:
        one = PLANTED[name]
        return ForFuzzing(name, check, (one[1:4],), one.breaks, *rest)
    breaks, needs, *changes = rest
    return ForFuzzing(name, check, tuple(changes), breaks, needs)


# Name and check, what it breaks, what it needs; then file, right text and wrong text of each change. Planted ones have
# what they change and break from there.
# fmt: off
_TABLE = (
    ("takes frames with a bad CRC", "accepts_only_sent", "a team frame with a wrong bit"),
    ("compares half of the CRC", "accepts_only_sent",
     "One damaged frame in 256 is obeyed.",
     "damage that leaves 8 bits of the CRC right",
     ("decode.c", "return crc_low == (CRC_RESIDUE & 0xFF) && crc_high == CRC_RESIDUE >> 8;",
      "return crc_low == (CRC_RESIDUE & 0xFF);")),
    ("counts a run in 8 bits", "acts_within_ms",
     "The 256th character without a pause begins the run again.",
     "a frame behind some 240 characters that are no frame, without a pause",
     ("decode.c", "    else if (run < RX_SIZE)\n        ++run;\n", "    else\n        ++run;\n")),
    ("writes back what waits", "acts_within_ms",
     "A character that comes while a frame is dealt with is forgotten, and the decoder stays behind.",
     "a character within 2 ms after a frame, then a frame",
     ("uart.h", "extern volatile u8 rx_count; ", "extern volatile u8 rx_waiting, rx_count; "),
     ("uart.c", "volatile u8 rx_count;\n", "volatile u8 rx_waiting, rx_count;\n"),
     ("uart.c", "            ++rx_count;\n", "            ++rx_count;\n            ++rx_waiting;\n"),
     ("main.c", "        else if (rx_taken != rx_count) {\n",
      """        else if (rx_waiting) {
            u8 waiting = rx_waiting;

"""),
     ("main.c", "                act();\n", "                act();\n            rx_waiting = waiting - 1;\n")),
    ("takes from the count of the interrupt", "acts_within_ms",
     "A character whose interrupt falls into a few microseconds after a frame is forgotten.",
     "a character in a window of some microseconds after a frame, then a frame",
     ("uart.h", "extern volatile u8 rx_count; ", "extern volatile u8 rx_waiting, rx_count; "),
     ("uart.c", "volatile u8 rx_count;\n", "volatile u8 rx_waiting, rx_count;\n"),
     ("uart.c", "            ++rx_count;\n", "            ++rx_count;\n            ++rx_waiting;\n"),
     ("main.c", "        else if (rx_taken != rx_count) {\n",
      """        else if (rx_waiting) {
            u8 left, taken = 0;

            do
"""),
     ("main.c", "volatile u8 sleep;\n", "volatile u8 sleep;\nstatic u8 most_taken;\n"),
     ("main.c", "                    act();\n            }\n",
      """                    act();
            }
            while (++taken != rx_waiting);
            left = rx_waiting - taken;
            if (most_taken < taken)
                most_taken = taken;
            rx_waiting = left;
""")),
    ("damaged frames feed the failsafe", "failsafe_stop_ms",
     "A frame that noise has changed restarts the failsafe.",
     "motion, then a frame with a wrong bit, then silence",
     ("decode.c", '#include "uart.h"\n', '#include "failsafe.h"\n#include "uart.h"\n'),
     ("decode.c", "        ++frames_rejected;\n", "        ++frames_rejected;\n        failsafe_start();\n")),
    ("takes a ninth step", "moves_only_when_fresh",
     "A number that is nine ahead is fresh within 150 ms.",
     "a number that is just nine ahead, soon",
     ("failsafe.c", "(step > FRESH_STEPS &&", "(step > FRESH_STEPS + 1 &&")),
    ("keeps its memory over a reset", "moves_only_when_fresh", "a reset, then an old number"),
    ("cuts off by a difference", "acts_within_ms",
     "The difference overflows: full speed backward becomes full speed ahead.",
     "a velocity below -16135",
     ("motion.c", "    if (velocity > VELOCITY_SATURATION)\n",
      """    int beyond = velocity - VELOCITY_SATURATION;

    if (beyond > 0)
""")),
    ("takes one byte too many for gains", "no_fault",
     "The ninth byte falls on the return address of the main loop's call.",
     "a service frame with gains for this robot, and one of some bytes after them",
     ("motion.c", "i != sizeof filter; ++i)", "i <= sizeof filter; ++i)")),
    ("waits for standstill", "failsafe_stop_ms",
     "An acceleration that comes in motion stops the main loop for ever.",
     "motion, then a service frame with an acceleration for this robot",
     ("motion.c", "        acceleration_waits = 1;\n        motion_tick();\n",
      """        acceleration_waits = 1;
        while (acceleration_waits)
            motion_tick();
""")),
    ("does not look at the opcode's range", "no_fault",
     "An opcode above 2 calls what stands behind the table of functions.",
     "a service frame with an opcode above 2 for this robot",
     ("motion.c", "/* A fresh service frame. Unknown opcodes count as ping. */\n",
      """static void ping(void)
{
}

static void set_filter(void)
{
    u8 i;

    for (i = 0; i != sizeof filter; ++i)
        filter[i] = (PAYLOAD + SERVICE_KP)[i];
    load_filter();
}

static void set_acceleration(void)
{
    u8 i;

    for (i = 0; i != sizeof acceleration; ++i)
        acceleration[i] = (PAYLOAD + SERVICE_ACCELERATION)[i];
    acceleration_waits = 1;
    motion_tick();
}

typedef void (*action)(void);
static const __code action actions[] = {ping, set_filter, set_acceleration};

"""),
     ("motion.c",
      """    switch (PAYLOAD[SERVICE_OPCODE]) {
    case OPCODE_FILTER:
        for (i = 0; i != sizeof filter; ++i)
            filter[i] = PAYLOAD[SERVICE_KP + i];
        load_filter();
        break;
    case OPCODE_ACCELERATION:
        for (i = 0; i != sizeof acceleration; ++i)
            acceleration[i] = PAYLOAD[SERVICE_ACCELERATION + i];
        acceleration_waits = 1;
        motion_tick();
        break;
    }
""",
      "    i = PAYLOAD[SERVICE_OPCODE];\n    actions[i]();\n")),
    ("calls itself as often as a frame says", "no_fault",
     "The stack goes over the end of internal RAM.",
     "a service frame with opcode 2Bh and a large next byte for this robot",
     ("motion.c", "    case OPCODE_ACCELERATION:\n",
      """    case 0x2B:
        if (PAYLOAD[2]--) {
            motion_service();
            motion_tick();
        }
        break;
    case OPCODE_ACCELERATION:
""")),
    ("jumps into a loader that is not there", "no_fault",
     "A word of four letters starts what is no program.",
     "a service frame with opcode B0h and LOAD for this robot",
     ("motion.c", "    case OPCODE_ACCELERATION:\n",
      """    case 0xB0:
        if (PAYLOAD[2] == 'L' && PAYLOAD[3] == 'O' && PAYLOAD[4] == 'A' && PAYLOAD[5] == 'D')
            ((void (*)(void))0x1F00)();
        break;
    case OPCODE_ACCELERATION:
""")),
    ("does not poll while an answer goes out", "no_fault",
     "What is written while the answer goes out falls into a busy LM629.",
     "an acceleration in motion, then a question to this robot that stops it",
     ("lm629.c", "/* True when all selected chips may be written. */\n", "extern volatile __bit tx_busy;\n\n"),
     ("lm629.c", "    if (selected != RIGHT && !wait_for(LEFT))\n",
      """    if (tx_busy)
        return true;
    if (selected != RIGHT && !wait_for(LEFT))
""")),
    ("clears both flags of the serial port", "answers_within_ms",
     "A character that comes in the microseconds in which one has gone out stops the answer.",
     "an answer, and characters with just its phase meanwhile",
     ("uart.c", "            RI = 0;\n", "            SCON &= 0xFC;\n")),
)
# fmt: on
FOR_FUZZING = {name: _mistake(name, *rest) for name, *rest in _TABLE}
