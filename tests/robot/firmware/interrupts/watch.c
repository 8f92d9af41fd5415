/* Waits for the chips' host interrupts: HI of the left one at /INT0, of the right one at /INT1, through inverters.
 *
 * HI stays high until the flag is cleared or masked, which takes the bus, and the main loop may be in the middle of a bus
 * cycle. So an interrupt only switches itself off and wakes the main loop, which asks the chips and switches it on again.
 */

#include "watch.h"

#include "lm629.h"
#include "protocol.h"
#include "uart.h"

#define STATUS_COMPLETE 0x04

volatile __bit watch_due;

static __bit lost;
static u8 stopping;                     /* AND of the chips that have finished: BOTH in the end */
static u8 straps;                       /* wraps: the straps are read every 256 ms at least */

void watch_left(void) __interrupt(IE0_VECTOR)
{
    EX0 = 0;
    watch_due = 1;
    sleep = 0;
}

void watch_right(void) __interrupt(IE1_VECTOR)
{
    EX1 = 0;
    watch_due = 1;
    sleep = 0;
}

static void mask(u8 flags)
{
    lm629_command(MSKI);
    lm629_word(0, flags);
}

static void clear(u8 flags)
{
    lm629_command(RSTI);
    lm629_word(0, (u8)~flags);
}

void watch_start(void)
{
    stopping = 0xFF;
    lost = 0;
    mask(STATUS_POSITION_ERROR | STATUS_COMPLETE);
    lm629_command(LPES);
    lm629_word(POSITION_ERROR_MAX >> 8, POSITION_ERROR_MAX & 0xFF);
    EX0 = 1;                            /* IT0 and IT1 stay 0: by level */
    EX1 = 1;
}

void watch_stopping(void)
{
    stopping = 0xFF;
    lm629_select(BOTH);
    clear(STATUS_COMPLETE);
}

void watch_tick(void)
{
    if (!++straps)
        watch_due = 1;
}

/* What a chip has to tell. The flag of a position error stays in the status byte, where the host reads it. */
static void ask(u8 chip)
{
    u8 status = lm629_status(chip);

    lm629_select(chip);
    if (status & STATUS_POSITION_ERROR) {
        lost = 1;
        mask(STATUS_COMPLETE);
    }
    if (status & STATUS_COMPLETE) {
        stopping &= chip;
        clear(STATUS_COMPLETE);
    }
}

bool watch_lost(void)
{
    if (!EX0)
        ask(LEFT);
    if (!EX1)
        ask(RIGHT);
    EX0 = 1;
    EX1 = 1;
    return lost;
}

void watch_clear(void)
{
    lost = 0;
    lm629_select(BOTH);
    clear(STATUS_POSITION_ERROR);
    mask(STATUS_POSITION_ERROR | STATUS_COMPLETE);
}

bool watch_stopped(void)
{
    return stopping == BOTH;
}
