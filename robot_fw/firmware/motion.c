/* Velocities to LM629 trajectories, and the settings that service frames change.
 *
 * What belongs here: what the two chips are told. What does not: when (main.c, failsafe.c) and how bytes reach them
 * (lm629.c).
 *
 * A velocity of 1/256 count per sample is the chip's 16.16 number shifted right by 8: no arithmetic, only bytes. A
 * wheel that is commanded 0 gets velocity 0 in velocity mode. Both trajectories are loaded first, then one STT goes to
 * both chips in one write cycle, so both wheels start in the same sample.
 */

#include "motion.h"

#include "decode.h"
#include "failsafe.h"
#include "filter.h"
#include "lm629.h"
#include "protocol.h"
#include "uart.h"
#include "watch.h"

#define BOOT_TRIES      8
#define RETRY_TRIES     1   /* while frames come in there is no time for more */
#define RECOVERIES      8   /* resets of the chips in motion, with fewer than 256 team frames between two of them */

#define LOW(word)       ((word) & 0xFF)
#define HIGH(word)      ((word) >> 8)

#define STATE_OFF       0   /* motors off: after reset and 500 ms after the last fresh frame */
#define STATE_DRIVING   1   /* velocity mode */
#define STATE_STOPPED   2   /* smooth stop under way or done, loop closed */

u8 slot;
int last_left, last_right;

static u8 state;
static u8 recoveries, frames_between;
static __bit acceleration_waits;
static __bit lost;          /* a wheel does not follow: off until the host tells both wheels to stand */

/* Settings as they came over the air, low byte first; they survive a reset of the chips. */
static __idata u8 acceleration[4] = {LOW(DEFAULT_ACCELERATION), HIGH(DEFAULT_ACCELERATION), 0, 0};
static __idata u8 filter[8] = {
    LOW(FILTER_KP), HIGH(FILTER_KP), LOW(FILTER_KI), HIGH(FILTER_KI),
    LOW(FILTER_KD), HIGH(FILTER_KD), LOW(FILTER_IL), HIGH(FILTER_IL),
};

static void load_filter(void)
{
    u8 i;

    lm629_select(BOTH);
    lm629_command(LFIL);
    lm629_word(FILTER_DS, FIL_ALL);
    for (i = 0; i != sizeof filter; i += 2)
        lm629_word(filter[i + 1], filter[i]);
    lm629_command(UDF);
}

/* Into the buffers only: it takes effect with the next STT, which both chips must be free to execute. */
static void load_acceleration(void)
{
    acceleration_waits = 0;
    lm629_select(BOTH);
    lm629_command(LTRJ);
    lm629_word(0, TRJ_ACCELERATION);
    lm629_word(acceleration[3], acceleration[2]);
    lm629_word(acceleration[1], acceleration[0]);
}

static void reset_chips(u8 tries)
{
    state = STATE_OFF;
    failsafe_flags |= FLAG_MOTORS_OFF;
    if (!lm629_reset(tries))
        return;
    watch_start();
    load_filter();
    load_acceleration();
}

void motion_start(void)
{
    slot = STRAP_SLOT;
    reset_chips(BOOT_TRIES);
}

static int saturated(u8 at)
{
    int velocity = (int)((u16)PAYLOAD[at + 1] << 8 | PAYLOAD[at]);

    if (velocity > VELOCITY_SATURATION)
        return VELOCITY_SATURATION;
    if (velocity < -VELOCITY_SATURATION)
        return -VELOCITY_SATURATION;
    return velocity;
}

static void load_velocity(u8 chip, int velocity)
{
    u8 mode = TRJ_VELOCITY | TRJ_FORWARD;
    u16 speed = velocity;

    if (velocity < 0) {
        mode = TRJ_VELOCITY;
        speed = -velocity;
    }
    lm629_select(chip);
    lm629_command(LTRJ);
    lm629_word(mode, TRJ_SPEED);
    lm629_word(0, HIGH(speed));
    lm629_word(LOW(speed), 0);
}

static void start_both(void)
{
    lm629_select(BOTH);
    lm629_command(STT);
}

static void halt_both(u8 how)
{
    lm629_select(BOTH);
    lm629_command(LTRJ);
    lm629_word(how, 0);
    start_both();
}

/* Stops both wheels with the acceleration in force; the loops stay closed. */
void motion_stop(void)
{
    if (state != STATE_DRIVING)
        return;
    watch_stopping();
    halt_both(TRJ_SMOOTH_STOP);
    state = STATE_STOPPED;
}

/* Opens both loops: the wheels roll freely until the next velocities. */
void motion_off(void)
{
    if (state == STATE_OFF)
        return;
    halt_both(TRJ_MOTOR_OFF);
    state = STATE_OFF;
}

/* Resets chips that stopped answering, unless that has failed to help: one that stays busy again and again would move
 * the other wheel a little after each reset. */
static void recover(void)
{
    if (recoveries == RECOVERIES)
        return;
    ++recoveries;
    frames_between = 0;
    reset_chips(RETRY_TRIES);
}

/* Whether the wheels may turn: not while the last velocities ask for motion that a lost wheel would not follow. */
static bool may_drive(void)
{
    if (!lost)
        return true;
    if (last_left || last_right)
        return false;
    lost = 0;
    watch_clear();
    return true;
}

/* A fresh team frame: own velocities to both wheels. A robot whose slot strap is not below N never moves. */
void motion_team(void)
{
    u8 at = slot * PAIR_SIZE;

    if (slot >= robots)
        return;
    if (!lm629_ready)
        recover();
    else if (!++frames_between)
        recoveries = 0;
    last_left = saturated(at + PAIR_LEFT);
    last_right = saturated(at + PAIR_RIGHT);
    if (!may_drive())
        return;
    if (acceleration_waits && !last_left && !last_right) {
        motion_stop();
        return;
    }
    load_velocity(LEFT, last_left);
    load_velocity(RIGHT, last_right);
    start_both();
    state = STATE_DRIVING;
}

/* A fresh service frame. Unknown opcodes count as ping. */
void motion_service(void)
{
    u8 i;

    if (PAYLOAD[SERVICE_SLOT] != slot)
        return;
    switch (PAYLOAD[SERVICE_OPCODE]) {
    case OPCODE_FILTER:
        for (i = 0; i != sizeof filter; ++i)
            filter[i] = PAYLOAD[SERVICE_KP + i];
        load_filter();
        break;
    case OPCODE_ACCELERATION:
        for (i = 0; i != sizeof acceleration; ++i)
            acceleration[i] = PAYLOAD[SERVICE_ACCELERATION + i];
        acceleration_waits = 1;
        motion_tick();
        break;
    }
}

/* A wheel that does not follow (an encoder's wire is broken, or something holds it) has been switched off by its chip;
 * the other one goes off with it, or the robot would turn on the spot. The straps are read again, so that damaged copies
 * do not last. */
void motion_watch(void)
{
    watch_due = 0;
    slot = STRAP_SLOT;
    decode_strap();
    if (state == STATE_OFF || !watch_lost())
        return;
    motion_off();
    lost = lm629_ready;     /* a chip that does not answer reads as FFh: that is for recover() */
}

/* Loads a waiting acceleration at standstill. The LM629 refuses an STT with a new acceleration while its profile
 * generator runs, and in velocity mode it always runs; so both must have finished a stop, or be off. Characters go
 * first: asking the chips each millisecond and testing a frame behind every sync is more than there is time for. */
void motion_tick(void)
{
    if (!acceleration_waits || state == STATE_DRIVING || rx_taken != rx_count)
        return;
    if (state == STATE_STOPPED && !watch_stopped())
        return;
    load_acceleration();
}
