/* What the two wheels are told. */

#ifndef MOTION_H
#define MOTION_H

#include "board.h"

extern u8 slot;                     /* place in the team frame, 0..N-1 */
extern int last_left, last_right;   /* own velocities of the last fresh team frame, saturated; for observers */

void motion_start(void);
void motion_team(void);
void motion_service(void);
void motion_tick(void);
void motion_watch(void);
void motion_stop(void);
void motion_off(void);

#endif
