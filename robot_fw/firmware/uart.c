/* The serial interrupt: every character gets a mark that says whether it continues a run.
 *
 * What belongs here: Timer 2 as baud generator, Timer 0 as the gauge of the spacing, one ring in, one frame out. What
 * does not: any look at what a character means (decode.c).
 *
 * RI comes 9 10/16 bits after the start edge, always, so RI to RI is start to start. Timer 0 is restarted by every
 * character with a preload that lets it overflow at the end of the accepted spacing: an overflow is a gap. What
 * disturbs the gauge is the interrupt's own latency: 3 to 9 cycles, and at most one transmit branch more.
 */

#include "uart.h"

/* Cycles from stopping Timer 0 to starting it again; counted in uart.asm, checked by test_reception.py. */
#define RESTART_CYCLES  9
#define PRELOAD         (65536UL - SPACING_MAX - 1 + RESTART_CYCLES)

#define BAUD_BY_TIMER2  0x34    /* T2CON: RCLK, TCLK, TR2 */
#define MODE_1_RECEIVE  0x50    /* SCON: 8 bits, variable baud rate, REN; SM2 = 0, so damaged characters come too */

__idata u8 rx_character[RX_SIZE];
__idata u8 rx_mark[RX_SIZE];
volatile u8 rx_count;

__idata u8 tx_frame[TX_WIRE];
static volatile u8 tx_next;
volatile __bit tx_busy;

void uart_start(void)
{
    RCAP2H = TIMER2_RELOAD_HIGH;
    RCAP2L = TIMER2_RELOAD_LOW;
    TH2 = TIMER2_RELOAD_HIGH;
    TL2 = TIMER2_RELOAD_LOW;
    T2CON = BAUD_BY_TIMER2;
    SCON = MODE_1_RECEIVE;
    TF0 = 1;                    /* the first character follows nothing */
    TR0 = 1;
    PS = 1;                     /* above the tick: its latency is the gauge's error */
    ES = 1;
}

/* Sends tx_frame. Only when tx_busy is clear. */
void uart_send(void)
{
    tx_busy = 1;
    tx_next = 1;
    SBUF = tx_frame[0];
}

void uart_interrupt(void) __interrupt(SI0_VECTOR) __using(1)
{
    do {
        if (RI) {
            u8 low, high, place, mark;

            TR0 = 0;
            low = TL0;
            high = TH0;
            TL0 = PRELOAD & 0xFF;
            TH0 = PRELOAD >> 8;
            TR0 = 1;

            place = RX_INDEX(rx_count);
            rx_character[place] = SBUF;
            mark = MARK_FIRST;
            if (!RB8)
                mark = MARK_DAMAGED;
            else if (!TF0 && high == 0xFF && low >= 0xFF - (SPACING_MAX - SPACING_MIN))
                mark = MARK_FOLLOWS;
            TF0 = 0;
            RI = 0;
            rx_mark[place] = mark;
            ++rx_count;
        }
        if (TI) {
            TI = 0;
            if (tx_next == TX_WIRE)
                tx_busy = 0;
            else
                SBUF = tx_frame[tx_next++];
        }
    } while (RI);       /* sooner than leaving and entering again: the gauge is running */
    sleep = 0;
}
