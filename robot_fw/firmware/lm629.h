/* The two LM629 on their bit-banged bus. */

#ifndef LM629_H
#define LM629_H

#include <stdbool.h>

#include "board.h"

/* Selections: AND masks for the control port. BOTH is for writes only, two chips must not drive the bus. */
#define LEFT            0xF7
#define RIGHT           0xEF
#define BOTH            0xE7

/* Commands: data sheet SNVS781, User Command Set. */
#define STT             0x01    /* start motion: trajectory buffers take effect at the next sample */
#define UDF             0x04    /* filter buffers take effect at the next sample */
#define RDRP            0x0A    /* read real position */
#define RDSIGS          0x0C    /* read signals register */
#define LPES            0x1A    /* beyond this position error the motor goes off */
#define MSKI            0x1C    /* interrupt mask */
#define RSTI            0x1D    /* reset interrupt flags */
#define LFIL            0x1E    /* load filter */
#define LTRJ            0x1F    /* load trajectory */

/* Trajectory control word, high byte. */
#define TRJ_FORWARD     0x10
#define TRJ_VELOCITY    0x08
#define TRJ_SMOOTH_STOP 0x04
#define TRJ_MOTOR_OFF   0x01
/* ... and low byte. */
#define TRJ_ACCELERATION 0x20   /* two words follow */
#define TRJ_SPEED       0x08    /* two words follow */

#define FIL_ALL         0x0F    /* filter control word, low byte: kp, ki, kd, il follow */
#define SIG_ON_TARGET   0x04    /* signals register, high byte: the profile generator has finished */
#define STATUS_POSITION_ERROR 0x20 /* the position error was larger than LPES allows; RSTI clears it */

extern __bit lm629_ready;       /* both chips answer; while it is clear nothing here touches them */

bool lm629_reset(u8 tries);
void lm629_select(u8 chips);
u8 lm629_status(u8 chip);
void lm629_command(u8 opcode);
void lm629_word(u8 high, u8 low);
u16 lm629_read_word(void);

#endif
