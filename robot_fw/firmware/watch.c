/* Looks at the chips now and then: no host interrupts.
 *
 * What belongs here: how the firmware learns what the chips have to tell. What does not: what it does then (motion.c).
 */

#include "watch.h"

#include "failsafe.h"
#include "lm629.h"
#include "protocol.h"

#define EVERY_MASK      3   /* each fourth millisecond */

volatile __bit watch_due;

void watch_start(void)
{
    lm629_command(MSKI);                /* HI stays low */
    lm629_word(0, 0);
    lm629_command(LPES);
    lm629_word(POSITION_ERROR_MAX >> 8, POSITION_ERROR_MAX & 0xFF);
}

void watch_stopping(void)
{
}

void watch_tick(void)
{
    if (!(ticks_taken & EVERY_MASK))
        watch_due = 1;
}

bool watch_lost(void)
{
    return (lm629_status(LEFT) | lm629_status(RIGHT)) & STATUS_POSITION_ERROR;
}

void watch_clear(void)
{
    lm629_select(BOTH);
    lm629_command(RSTI);
    lm629_word(0, (u8)~STATUS_POSITION_ERROR);
}

static bool on_target(u8 chip)
{
    lm629_select(chip);
    lm629_command(RDSIGS);
    return (lm629_read_word() >> 8) & SIG_ON_TARGET;
}

bool watch_stopped(void)
{
    return on_target(LEFT) && on_target(RIGHT);
}
