/* Freshness of frames, and what happens without them. */

#ifndef FAILSAFE_H
#define FAILSAFE_H

#include <stdbool.h>

#include "board.h"

extern u16 frames_accepted, frames_stale;
extern u8 last_hdr;                 /* HDR of the last fresh frame; for observers */
extern u8 failsafe_flags;           /* FLAG_STOPPED, FLAG_MOTORS_OFF: happened since the last telemetry */
extern volatile u8 ticks;
extern u8 ticks_taken;

void failsafe_start(void);
void failsafe_look(void);
bool failsafe_fresh(void);
void failsafe_tick(void);
void failsafe_interrupt(void) __interrupt(TF1_VECTOR);

#endif
