/* The age of the last fresh frame: which frame is fresh, when the wheels stop, when the motors go off.
 *
 * What belongs here: Timer 1 as the tick, the 150, 110 and 500 ms of protocol/README.md. What does not: how to stop (motion.c).
 *
 * Every fresh frame restarts Timer 1, so the age does not depend on where the frame fell between two ticks. It counts
 * from the frame's last character, not from when the robot comes to it, and it runs ahead by the time that the command to
 * stop takes: the wheels are told to stop 110 ms after that character.
 */

#include "failsafe.h"

#include "decode.h"
#include "motion.h"
#include "protocol.h"
#include "uart.h"
#include "watch.h"

/* Cycles for which the interrupt holds Timer 1; counted in failsafe.asm, checked by test_failsafe.py. */
#define HELD_CYCLES     6
#define RELOAD          (65536UL - CYCLES_PER_MS)
#define AGE_MAX         1000

/* Cycles from a tick to the STT of the stop that it brings, and from look_back() to the restart of Timer 1. */
#define STOPPING        720

u16 frames_accepted, frames_stale;
u8 last_hdr;
u8 failsafe_flags;
volatile u8 ticks;                  /* milliseconds, wraps */
u8 ticks_taken;

static u16 age;                     /* ms since the last fresh frame, stays at AGE_MAX */
static __bit heard;                 /* there was one */

/* What read_clock() found. Timer 1 shows RELOAD at a tick and counts cycles from there. */
static u8 clock_ticks;
static u16 clock_timer;

/* When the last character of the frame under test was complete, on the same clock; the timer part may lie before its tick. */
static u8 ended_ticks;
static u16 ended_timer;

/* The age of that frame when it turns out to be fresh, and the time that a stop takes: whole milliseconds, and what
 * Timer 1 shows so long after them. */
static u8 spent_ms;
static u16 spent_from;

static void read_clock(void)
{
    u8 high, low;

    do {
        clock_ticks = ticks;
        high = TH1;
        low = TL1;
    } while (high != TH1 || clock_ticks != ticks);
    clock_timer = (u16)high << 8 | low;
}

/* Notes when the frame ended, before the test of it: only if the robot was busy with something else for a character's
 * time can one have come in behind it. Timer 0 counts from the last character at all (uart.c); those behind the frame
 * count as if they had followed without a gap. */
void failsafe_look(void)
{
    u8 behind, high, low;

    do {
        behind = rx_count;
        read_clock();
        high = TH0;
        low = TL0;
    } while (high != TH0 || behind != rx_count);
    ended_ticks = clock_ticks;
    ended_timer = clock_timer - ((u16)high << 8 | low) - SPACING_MAX;
    for (behind -= rx_taken; behind; --behind)
        ended_timer -= SPACING_NOMINAL;
}

static void look_back(void)
{
    u16 cycles;

    read_clock();
    cycles = (u8)(clock_ticks - ended_ticks) * CYCLES_PER_MS + clock_timer - ended_timer + STOPPING;
    spent_ms = 0;
    for (; cycles >= CYCLES_PER_MS; cycles -= CYCLES_PER_MS)
        ++spent_ms;
    spent_from = RELOAD + cycles;
}

static void restart(void)
{
    TR1 = 0;
    TF1 = 0;
    TL1 = spent_from & 0xFF;
    TH1 = spent_from >> 8;
    ticks_taken = ticks;
    age = spent_ms;
    TR1 = 1;
}

void failsafe_start(void)
{
    spent_from = RELOAD;
    restart();
    ET1 = 1;
}

/* Whether FRESH_AGAIN_MS have passed from the last character of the last fresh frame to that of this one, whose decoding
 * has taken time too: whole milliseconds and what Timer 1 then shows. */
static bool fresh_again(void)
{
    u8 waiting;
    u16 whole;

    read_clock();       /* again: as long behind look_back() as Timer 1 was restarted behind it */
    waiting = clock_ticks - ticks_taken;    /* on its own: SDCC 4.2.0 drops the cast in age + (u8)(...) */
    whole = age + waiting - spent_ms;
    if (whole != FRESH_AGAIN_MS)
        return whole > FRESH_AGAIN_MS;
    return clock_timer >= spent_from;
}

/* Whether the valid frame in `body` is fresh; if so it restarts the failsafe. */
bool failsafe_fresh(void)
{
    u8 step = (HDR - last_hdr) & SEQ_MASK;

    look_back();
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
    watch_tick();
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
