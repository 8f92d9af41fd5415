/* What lies between a byte in clear and a byte on the air: the CRC over the clear one, and PN9 whitening.
 *
 * What belongs here: the two tables and the steps over one byte. What does not: where a frame begins or ends
 * (decode.c, telemetry.c). Main loop only; about 130 cycles a byte, against 2080 cycles per character.
 */

#define PROTOCOL_TABLES
#include "wire.h"

#include "protocol.h"

u8 crc_low, crc_high;
static u8 at;               /* place in the whitening string */

/* Begins a frame; `crc` is the register after the layout byte, CRC_START_x. */
void wire_start(u16 crc)
{
    crc_low = crc & 0xFF;
    crc_high = crc >> 8;
    at = 0;
}

static inline void crc_nibble(u8 index)
{
    index = (index ^ crc_low) & 0x0F;
    crc_low = (u8)(crc_low >> 4 | crc_high << 4) ^ crc_nibble_low[index];
    crc_high = (u8)(crc_high >> 4) ^ crc_nibble_high[index];
}

static void crc_byte(u8 clear)
{
    crc_nibble(clear);
    crc_nibble(clear >> 4);
}

/* Whitens or un-whitens the next byte. */
u8 wire_whiten(u8 value)
{
    return value ^ whitening[at++];
}

/* A received byte: returns it in clear, and the CRC goes on over it. */
u8 wire_take(u8 sent)
{
    u8 clear = wire_whiten(sent);

    crc_byte(clear);
    return clear;
}

/* A byte to send: the CRC goes on over it, returns what goes on the air. */
u8 wire_put(u8 clear)
{
    crc_byte(clear);
    return wire_whiten(clear);
}
