/* The robot's firmware: starts everything, then turns characters into motion and sleeps in between.
 *
 * What belongs here: the order of things. What does not: any of the things.
 */

#include "board.h"
#include "decode.h"
#include "failsafe.h"
#include "motion.h"
#include "protocol.h"
#include "telemetry.h"
#include "uart.h"
#include "watch.h"

#define IDL         0x01    /* PCON: idle until the next interrupt */
#define TIMERS_16   0x11    /* TMOD: Timer 0 and 1 count machine cycles, 16 bits */

/* What the main loop writes to PCON when it finds no work. It is set to IDL before the search, and every interrupt
 * sets it to 0. The write is one MOV PCON,sleep, which no interrupt can split: work that turned up anywhere between
 * the search and the write keeps the CPU awake, and nothing ever disables interrupts. */
volatile u8 sleep;

static void act(void)
{
    switch (HDR & TYPE_MASK) {
    case TYPE_TEAM:
        motion_team();
        break;
    case TYPE_TEAM_ASK:
        motion_team();
        telemetry_answer();
        break;
    case TYPE_SERVICE:
        motion_service();
        break;
    }
}

void main(void)
{
    TMOD = TIMERS_16;
    decode_strap();
    motion_start();
    uart_start();
    failsafe_start();
    EA = 1;
    for (;;) {
        sleep = IDL;
        if (ticks_taken != ticks)
            failsafe_tick();
        else if (watch_due)
            motion_watch();
        else if (rx_taken != rx_count) {
            if (decode_character()) {
                failsafe_look();
                if (decode_valid() && failsafe_fresh())
                    act();
            }
        } else
            PCON = sleep;
    }
}
