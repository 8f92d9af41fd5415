/* Finds valid frames: a window of F characters that slides over the ring, one character a call.
 *
 * What belongs here: "valid" as protocol/README.md has it: sync matches F back, all F stop bits good, all F - 1 spacings
 * good, CRC good; then the window is cleared. What does not: whether the frame is new (failsafe.c) and what it says
 * (motion.c).
 *
 * Stop bits and spacings need no memory of their own: `run` counts the good characters that follow each other without
 * a gap, so the window is clean exactly when run >= F.
 */

#include "decode.h"

#include "uart.h"
#include "wire.h"

u8 robots;
__idata u8 body[RX5_WHITENED];
u16 frames_rejected;
u8 rx_taken;                            /* characters looked at so far, wraps */

static u8 run;
static u8 frame_size;                   /* F */

/* Reads the strap that says how many robots the network has. */
void decode_strap(void)
{
    robots = STRAP_THREE ? 3 : 5;
    frame_size = robots == 3 ? RX3_FRAME : RX5_FRAME;
}

/* Takes HDR..CRC out of the ring into `body`, in clear. True when the CRC is good. */
static bool take_body(u8 from)
{
    u8 size = frame_size - RX3_AT_HDR;
    u8 i;

    wire_start(robots == 3 ? CRC_START_RX3 : CRC_START_RX5);
    for (i = 0; i != size; ++i)
        body[i] = wire_take(rx_character[RX_INDEX(from + i)]);
    return crc_low == (CRC_RESIDUE & 0xFF) && crc_high == CRC_RESIDUE >> 8;
}

/* Looks at the next character of the ring (there must be one). True when it completes a window that is a frame if its
 * CRC is good. */
bool decode_character(void)
{
    u8 mark = rx_mark[RX_INDEX(rx_taken)];
    u8 from;

    /* Too far behind, the oldest of the window may be overwritten: as good as a gap. */
    if (mark == MARK_DAMAGED || (u8)(rx_count - rx_taken) > RX_SIZE - RX5_FRAME)
        run = 0;
    else if (mark == MARK_FIRST)
        run = 1;
    else if (run < RX_SIZE)
        ++run;
    ++rx_taken;
    if (run < frame_size)
        return false;
    from = rx_taken - frame_size;
    return rx_character[RX_INDEX(from)] == SYNC_0 && rx_character[RX_INDEX(from + 1)] == SYNC_1;
}

/* Whether the window that decode_character() found is a valid frame; takes 1.1 ms in a network of three, 1.65 ms of five. */
bool decode_valid(void)
{
    if (!take_body(rx_taken - frame_size + RX3_AT_HDR)) {
        ++frames_rejected;
        return false;
    }
    run = 0;
    return true;
}
