/* Answers a poll: both status bytes, both positions and the counters, in one frame on the second band.
 *
 * What belongs here: which robot answers, and the frame it sends. What does not: sending it (uart.c).
 */

#include "telemetry.h"

#include "decode.h"
#include "failsafe.h"
#include "lm629.h"
#include "motion.h"
#include "protocol.h"
#include "uart.h"
#include "wire.h"

#define TX_AT_SYNC      (TX_PREAMBLE + 1)

static u8 at;

static void put(u8 clear)
{
    tx_frame[at++] = wire_put(clear);
}

/* Low word of the real position. */
static u16 position(u8 chip)
{
    lm629_select(chip);
    lm629_command(RDRP);
    lm629_read_word();
    return lm629_read_word();
}

static void put_word(u16 word)
{
    put(word & 0xFF);
    put(word >> 8);
}

static void begin(void)
{
    for (at = 0; at != TX_PREAMBLE; ++at)
        tx_frame[at] = PREAMBLE_BYTE;
    tx_frame[TX_PREAMBLE] = PREAMBLE_LAST;
    tx_frame[TX_AT_SYNC] = SYNC_0;
    tx_frame[TX_AT_SYNC + 1] = SYNC_1;
    at = TX_AT_SYNC + TX_AT_HDR;
    wire_start(CRC_START_TX);
}

/* A type 3 frame came: this robot answers when it is its turn. A frame still going out is not disturbed. */
void telemetry_answer(void)
{
    u8 seq = HDR & SEQ_MASK;
    u8 low, high;

    if (seq % robots != slot || tx_busy)
        return;
    begin();
    put(TYPE_TELEMETRY | seq);
    put(slot | failsafe_flags | (lm629_ready ? 0 : FLAG_INIT_FAILED));
    failsafe_flags = 0;
    put(lm629_status(LEFT));
    put(lm629_status(RIGHT));
    put_word(position(LEFT));
    put_word(position(RIGHT));
    put(frames_accepted & 0xFF);
    put(frames_rejected & 0xFF);
    low = crc_low ^ (CRC_XOR_OUT & 0xFF);
    high = crc_high ^ (CRC_XOR_OUT >> 8);
    tx_frame[at++] = wire_whiten(low);
    tx_frame[at] = wire_whiten(high);
    uart_send();
}
