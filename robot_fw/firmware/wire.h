/* Whitening and CRC, byte by byte, for both directions. */

#ifndef WIRE_H
#define WIRE_H

#include "board.h"

extern u8 crc_low, crc_high;

void wire_start(u16 crc);
u8 wire_take(u8 sent);
u8 wire_put(u8 clear);
u8 wire_whiten(u8 value);

#endif
