/* The MIRO board as the firmware sees it: pins, clocks, and what follows from them.
 *
 * What belongs here: names of pins and numbers of the hardware. What does not: the wire format (protocol.h) and
 * behaviour. The same table stands in ../README.md for people.
 */

#ifndef BOARD_H
#define BOARD_H

#include <8052.h>

/* LM629 bus: P0 carries D7..D0 (board pull-ups), P2 the control lines, all active low but PS. */
#define LM629_DATA      P0
#define LM629_CONTROL   P2
#define LM629_PS        P2_0    /* 0 command and status, 1 data */
#define LM629_RD        P2_1
#define LM629_WR        P2_2
#define LM629_RST       P2_5    /* both chips: they leave reset together, so their samples coincide */
#define LM629_SELECTS   0x18    /* P2.3 /CS left, P2.4 /CS right */

/* Straps on P1. */
#define STRAP_SLOT      (P1 & 0x07)
#define STRAP_THREE     P1_3    /* high: network of 3 robots, low: of 5 */

/* A machine cycle is 12 clocks of 24 MHz: 0.5 us. One LM629 clock is 1/6 us. */

typedef unsigned char u8;
typedef unsigned int u16;

#endif
