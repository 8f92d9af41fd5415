/* A car that stops in front of obstacles. It takes letters on the serial port at 9600 baud:
 *
 *   g go   s stop   e emergency stop, until r   r ready again   ? says state and distance
 *
 * Timer 0 makes the PWM of both motors: 20 steps of 500 machine cycles, 92 Hz. Timer 2 counts machine cycles; the main
 * loop measures echo and servo pulses with it. A frame of the main loop lasts two periods of the PWM, 21.7 ms.
 */
#include <8052.h>

#define TRIG P1_1
#define ECHO P1_0
#define SERVO P1_2
#define ENA P2_0
#define ENB P2_5
#define LEFT_FORWARD P2_4
#define LEFT_BACKWARD P2_3
#define RIGHT_FORWARD P2_2
#define RIGHT_BACKWARD P2_1

#define STEP_CYCLES 500u
#define STEPS 20
#define CYCLES_PER_CM 53u /* 58 us at 921.6 kHz, rounded down */
#define NO_ECHO 0xFFFFu
#define ECHO_TIMEOUT 36000u /* 39 ms */
#define STOP_CM 25u
#define FRAMES_PER_PING 5
#define MIDDLE 1382u /* 1.5 ms */

enum { IDLE, GOING, BLOCKED, EMERGENCY };

static volatile unsigned char state = IDLE;
static volatile unsigned char duty = 0; /* steps of 20 in which the bridges are on */
static volatile unsigned char step = 0;
static volatile unsigned char frame = 0;
static volatile unsigned char asked = 0;
static unsigned int distance_cm = NO_ECHO;

static void motors_off(void)
{
    duty = 0;
    ENA = 0;
    ENB = 0;
}

void pwm(void) __interrupt(1)
{
    TL0 = (unsigned char)(65536u - STEP_CYCLES + 10);
    TH0 = (65536u - STEP_CYCLES + 10) >> 8;
    if (++step == STEPS) {
        step = 0;
        frame++;
        if (duty) {
            ENA = 1;
            ENB = 1;
        }
    }
    if (step == duty) {
        ENA = 0;
        ENB = 0;
    }
}

void serial(void) __interrupt(4)
{
    unsigned char letter;
    if (!RI)
        return;
    RI = 0;
    letter = SBUF;
    if (letter == 'e') {
        motors_off();
        state = EMERGENCY;
    } else if (letter == 'r') {
        if (state == EMERGENCY)
            state = IDLE;
    } else if (letter == 'g') {
        if (state != EMERGENCY)
            state = GOING;
    } else if (letter == 's') {
        motors_off();
        if (state != EMERGENCY)
            state = IDLE;
    } else if (letter == '?') {
        asked = 1;
    }
}

static void say(char letter)
{
    ES = 0;
    TI = 0;
    SBUF = letter;
    while (!TI)
        ;
    TI = 0;
    ES = 1;
}

static void say_number(unsigned int number)
{
    unsigned char digits[5], count = 0;
    do {
        digits[count++] = number % 10;
        number /= 10;
    } while (number);
    while (count)
        say('0' + digits[--count]);
}

static unsigned int now(void)
{
    unsigned char high, low;
    do { /* the low half may overflow between the two reads */
        high = TH2;
        low = TL2;
    } while (high != TH2);
    return (unsigned int)high << 8 | low;
}

static void wait(unsigned int cycles)
{
    unsigned int begun = now();
    while (now() - begun < cycles)
        ;
}

/* The distance in cm, NO_ECHO where none came. */
static unsigned int ping(void)
{
    unsigned int begun, rise;
    TRIG = 1;
    wait(12);
    TRIG = 0;
    begun = now();
    while (!ECHO)
        if (now() - begun > ECHO_TIMEOUT)
            return NO_ECHO;
    rise = now();
    while (ECHO)
        if (now() - rise > ECHO_TIMEOUT)
            return NO_ECHO;
    rise = now() - rise;
    return rise > 33000u ? NO_ECHO : rise / CYCLES_PER_CM;
}

static void drive(void)
{
    LEFT_BACKWARD = 0;
    RIGHT_BACKWARD = 0;
    LEFT_FORWARD = 1;
    RIGHT_FORWARD = 1;
    EA = 0; /* an `e` may come between the test and the order */
    if (state == GOING)
        duty = STEPS / 2;
    EA = 1;
}

static void decide(void)
{
    if (state != GOING && state != BLOCKED)
        return;
    if (distance_cm == NO_ECHO || distance_cm < STOP_CM) {
        EA = 0;
        motors_off();
        if (state == GOING)
            state = BLOCKED;
        EA = 1;
    } else {
        EA = 0;
        if (state == BLOCKED)
            state = GOING;
        EA = 1;
        drive();
    }
}

static void answer(void)
{
    asked = 0;
    say("igbe"[state]);
    say(' ');
    if (distance_cm == NO_ECHO)
        say('-');
    else
        say_number(distance_cm);
    say('\r');
    say('\n');
}

void main(void)
{
    unsigned char next, count = 0;
    motors_off();
    TRIG = 0;
    SERVO = 0;
    TMOD = 0x21; /* timer 1: 8 bits with reload; timer 0: 16 bits */
    TH1 = TL1 = 0xFD; /* 9600 baud at 11.0592 MHz */
    SCON = 0x50;
    T2CON = 0x04; /* counts machine cycles, from 0 again */
    RCAP2L = RCAP2H = 0;
    TR1 = 1;
    TR0 = 1;
    ET0 = 1;
    ES = 1;
    EA = 1;
    say('>');
    next = frame + 2;
    for (;;) {
        SERVO = 1;
        wait(MIDDLE);
        SERVO = 0;
        if (++count == FRAMES_PER_PING) {
            count = 0;
            distance_cm = ping();
            decide();
        }
        if (asked)
            answer();
        while ((signed char)(frame - next) < 0)
            ;
        next = frame + 2;
    }
}
