/* Whether the chips have something to tell: the same as robot_fw/firmware/watch.h, by host interrupts. */

#ifndef WATCH_H
#define WATCH_H

#include <stdbool.h>

#include "board.h"

extern volatile __bit watch_due;    /* the main loop has to call motion_watch() */

void watch_start(void);             /* the chips have been reset: what may interrupt, how far a wheel may be away */
void watch_stopping(void);          /* both will be told to stop smoothly */
void watch_tick(void);              /* a millisecond has passed */
bool watch_lost(void);              /* a chip has switched its motor off because of the position error */
void watch_clear(void);             /* it may drive again */
bool watch_stopped(void);           /* both have finished the stop that they were told last */

/* SDCC makes their vectors where main() sees them. */
void watch_left(void) __interrupt(IE0_VECTOR);
void watch_right(void) __interrupt(IE1_VECTOR);

#endif
