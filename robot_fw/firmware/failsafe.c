/* The age of the last fresh frame: which frame is fresh, when the wheels stop, when the motors go off.
 *
 * What belongs here: Timer 1 as the tick, the 150, 110 and 500 ms of protocol/README.md. What does not: how to stop (motion.c).
 *
 * Every fresh frame restarts Timer 1, so the age does not depend on where the frame fell between two ticks. It counts
 * from the frame's last character, not from the end of its decoding, and it runs ahead by the time that the command to
 * stop takes: the wheels are told to stop 110 ms after that character, not later.
 */

#include "failsafe.h"

#include "decode.h"
#include "motion.h"
#include "protocol.h"
#include "uart.h"

/* Cycles for which the interrupt holds Timer 1; counted in failsafe.asm, checked by test_failsafe.py. */
#define HELD_CYCLES     6
#define RELOAD          (65536UL - CYCLES_PER_MS)
#define AGE_MAX         1000

/* Cycles from a frame's last character to failsafe_fresh(), and from failsafe_tick() to the STT of a stop. */
#define DECODING_3      2200
#define DECODING_5      3300
#define STOPPING        600
/* What the age is when a frame turns out to be fresh: a full millisecond and a part of the next. */
#define AGE_AT_RESTART  1
#define FIRST_TICK_3    (65536UL - 2 * CYCLES_PER_MS + DECODING_3 + STOPPING)
#define FIRST_TICK_5    (65536UL - 2 * CYCLES_PER_MS + DECODING_5 + STOPPING)

u16 frames_accepted, frames_stale;
u8 last_hdr;
u8 failsafe_flags;
volatile u8 ticks;                  /* milliseconds, wraps */
u8 ticks_taken;

static u16 age;                     /* ms since the last fresh frame, stays at AGE_MAX */
static __bit heard;                 /* there was one */

static u16 first_tick(void)
{
    return robots == 3 ? FIRST_TICK_3 : FIRST_TICK_5;
}

static void restart(void)
{
    u16 first = first_tick();

    TR1 = 0;
    TF1 = 0;
    TL1 = first & 0xFF;
    TH1 = first >> 8;
    ticks_taken = ticks;
    age = AGE_AT_RESTART;
    TR1 = 1;
}

void failsafe_start(void)
{
    restart();
    ET1 = 1;
}

/* Whether FRESH_AGAIN_MS have passed from the last character of the last fresh frame to that of this one, whose decoding
 * has taken time too: in ticks one millisecond and what Timer 1 then shows. */
static bool fresh_again(void)
{
    u8 before, waiting, high, low;
    u16 whole, first = first_tick();

    do {
        before = ticks;
        waiting = before - ticks_taken;     /* on its own: SDCC 4.2.0 drops the cast in age + (u8)(...) */
        whole = age + waiting;
        high = TH1;
        low = TL1;
    } while (high != TH1 || before != ticks);
    if (whole != FRESH_AGAIN_MS + AGE_AT_RESTART)
        return whole > FRESH_AGAIN_MS + AGE_AT_RESTART;
    return ((u16)high << 8 | low) >= first;
}

/* Whether the valid frame in `body` is fresh; if so it restarts the failsafe. */
bool failsafe_fresh(void)
{
    u8 step = (HDR - last_hdr) & SEQ_MASK;

    if (heard && (!step || (step > FRESH_STEPS && !fresh_again()))) {
        ++frames_stale;
        return false;
    }
    restart();
    heard = 1;
    last_hdr = HDR;
    ++frames_accepted;
    return true;
}

/* A millisecond has passed. */
void failsafe_tick(void)
{
    ++ticks_taken;
    if (age != AGE_MAX)
        ++age;
    if (age == FAILSAFE_STOP_MS) {
        motion_stop();
        failsafe_flags |= FLAG_STOPPED;
    } else if (age == FAILSAFE_OFF_MS) {
        motion_off();
        failsafe_flags |= FLAG_MOTORS_OFF;
    }
    motion_tick();
}

/* Adds the reload to what Timer 1 has counted since it overflowed, so the latency does not add up. The low bytes must
 * not carry: the latency stays below 200 cycles. */
void failsafe_interrupt(void) __interrupt(TF1_VECTOR)
{
    TR1 = 0;
    TL1 += (RELOAD + HELD_CYCLES) & 0xFF;
    TH1 = RELOAD >> 8;
    TR1 = 1;
    ++ticks;
    sleep = 0;
}
