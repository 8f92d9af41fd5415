/* The serial port: received characters with their marks, and the telemetry frame on its way out. */

#ifndef UART_H
#define UART_H

#include <stdbool.h>

#include "board.h"
#include "protocol.h"

/* Marks of a received character. */
#define MARK_DAMAGED    0   /* stop bit was 0 */
#define MARK_FIRST      1   /* stop bit good, spacing to the character before is not that of a run */
#define MARK_FOLLOWS    2   /* stop bit good, start-to-start spacing within 1040 us +- 50 us */

/* The ring holds the decoder's window (25 characters at most) and up to 7 characters not yet looked at. */
#define RX_SIZE         32
#define RX_INDEX(count) ((u8)(count) & (RX_SIZE - 1))

extern __idata u8 rx_character[RX_SIZE];
extern __idata u8 rx_mark[RX_SIZE];
extern volatile u8 rx_count;            /* characters received so far, wraps */

extern __idata u8 tx_frame[TX_WIRE];
extern volatile __bit tx_busy;

extern volatile u8 sleep;

void uart_start(void);
void uart_send(void);
void uart_interrupt(void) __interrupt(SI0_VECTOR) __using(1);

#endif
