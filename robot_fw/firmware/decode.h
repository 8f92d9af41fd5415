/* The sliding window over received characters. */

#ifndef DECODE_H
#define DECODE_H

#include <stdbool.h>

#include "board.h"
#include "protocol.h"

extern u8 robots;                       /* N: 3 or 5 */
extern __idata u8 body[RX5_WHITENED];   /* last valid frame in clear: HDR, payload, CRC */
extern u16 frames_rejected;
extern u8 rx_taken;

#define HDR             body[0]
#define PAYLOAD         (body + 1)

void decode_strap(void);
bool decode_character(void);
bool decode_valid(void);

#endif
