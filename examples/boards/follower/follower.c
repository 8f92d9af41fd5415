/* A line follower. The button starts and stops it; a press counts when it has lasted 20 ms. The display shows what it
 * does, what the sensors see (# dark), how fast the wheels are to go, and how far the left one has rolled: timer 1 counts
 * the slots of its disc.
 *
 * The bridge has no enables: PWM is on the input that drives a wheel the wanted way, with the other input low; in the
 * rest of a period both are low, and the motor brakes. Timer 0 makes 20 steps of 500 machine cycles: 100 Hz at 12 MHz.
 */
#include <8052.h>

#define LEFT_FORWARD P1_0
#define LEFT_BACKWARD P1_1
#define RIGHT_FORWARD P1_2
#define RIGHT_BACKWARD P1_3
#define SENSORS ((P1 >> 4) & 7) /* bit 0: the left one */
#define BUTTON P3_3
#define LCD P2
#define RS P0_4
#define RW P0_3
#define E P0_2

#define STEP_CYCLES 500u
#define STEPS 20
#define PERIODS_PRESSED 2 /* 20 ms */
#define LOST_PERIODS 60   /* without a line for so long it stops */
#define FAST 14
#define SLOW 7
#define SLOWEST 3

#define LEFT_DARK 1
#define MIDDLE_DARK 2
#define RIGHT_DARK 4

static volatile signed char left = 0, right = 0; /* steps of 20, backward below 0 */
static volatile unsigned char step = 0;
static volatile unsigned char periods = 0;

void pwm(void) __interrupt(1)
{
    signed char way;
    TL0 = (unsigned char)(65536u - STEP_CYCLES + 10);
    TH0 = (65536u - STEP_CYCLES + 10) >> 8;
    if (++step == STEPS) {
        step = 0;
        periods++;
    }
    way = left;
    LEFT_FORWARD = way > (signed char)step;
    LEFT_BACKWARD = -way > (signed char)step;
    way = right;
    RIGHT_FORWARD = way > (signed char)step;
    RIGHT_BACKWARD = -way > (signed char)step;
}

/* Display */

static void write(unsigned char value, __bit is_text)
{
    unsigned char busy;
    LCD = 0xFF; /* inputs */
    RS = 0;
    RW = 1;
    do {
        E = 1;
        busy = LCD & 0x80;
        E = 0;
    } while (busy);
    RW = 0;
    RS = is_text;
    LCD = value;
    E = 1;
    E = 0;
}

static void show(unsigned char place, const char *text)
{
    write(0x80 | place, 0);
    while (*text)
        write(*text++, 1);
}

static void show_speed(unsigned char place, signed char speed)
{
    write(0x80 | place, 0);
    write(speed < 0 ? '-' : ' ', 1);
    if (speed < 0)
        speed = -speed;
    write('0' + speed / 10, 1);
    write('0' + speed % 10, 1);
}

static void show_way(unsigned char place)
{
    unsigned char high, low;
    unsigned int cm, unit = 1000;
    do { /* the low half may overflow between the two reads */
        high = TH1;
        low = TL1;
    } while (high != TH1);
    cm = (unsigned int)high << 8 | low;
    cm += cm / 50; /* a slot is 1.02 cm */
    write(0x80 | place, 0);
    for (; unit; unit /= 10)
        write('0' + cm / unit % 10, 1);
    show(place + 4, " cm");
}

static void pause(unsigned char count)
{
    unsigned char begun = periods;
    while ((unsigned char)(periods - begun) < count)
        ;
}

static void start_display(void)
{
    unsigned char count;
    RS = 0;
    RW = 0;
    E = 0;
    pause(5);
    for (count = 0; count < 3; count++) {
        LCD = 0x38; /* eight wires, two rows */
        E = 1;
        E = 0;
        pause(2);
    }
    write(0x38, 0);
    write(0x0C, 0);
    write(0x01, 0);
    write(0x06, 0);
}

/* Driving */

static void go(signed char new_left, signed char new_right)
{
    left = new_left;
    right = new_right;
}

/* Where the line is, it goes; where it has lost it, it turns to where it was last. */
static void follow(unsigned char seen)
{
    static unsigned char last = MIDDLE_DARK;
    if (seen)
        last = seen;
    switch (last) {
    case LEFT_DARK:
        go(SLOWEST, FAST);
        break;
    case LEFT_DARK | MIDDLE_DARK:
        go(SLOW, FAST);
        break;
    case RIGHT_DARK:
        go(FAST, SLOWEST);
        break;
    case RIGHT_DARK | MIDDLE_DARK:
        go(FAST, SLOW);
        break;
    default:
        go(FAST, FAST);
    }
}

/* Whether the button has gone down, and stayed so for 20 ms, since the last call. */
static __bit pressed(void)
{
    static unsigned char held = 0, before = 0;
    if (before == periods)
        return 0;
    before = periods;
    if (BUTTON) {
        held = 0;
        return 0;
    }
    if (held <= PERIODS_PRESSED)
        held++;
    return held == PERIODS_PRESSED;
}

void main(void)
{
    static unsigned char seen, lost_since = 0, shown = 0;
    __bit going = 0;
    P1 = 0xF0;
    TMOD = 0x51; /* timer 1: 16 bits, counts falling edges of T1; timer 0: 16 bits */
    TR1 = 1;
    TR0 = 1;
    ET0 = 1;
    EA = 1;
    start_display();
    show(0x00, "stop  ");
    for (;;) {
        if (pressed()) {
            going = !going;
            lost_since = periods;
            show(0x00, going ? "follow" : "stop  ");
        }
        seen = SENSORS;
        if (seen)
            lost_since = periods;
        if (going && (unsigned char)(periods - lost_since) > LOST_PERIODS) {
            going = 0;
            show(0x00, "lost  ");
        }
        if (going)
            follow(seen);
        else
            go(0, 0);
        if ((unsigned char)(periods - shown) >= 10) {
            shown = periods;
            write(0x80 | 0x0D, 0);
            write(seen & LEFT_DARK ? '#' : '-', 1);
            write(seen & MIDDLE_DARK ? '#' : '-', 1);
            write(seen & RIGHT_DARK ? '#' : '-', 1);
            show_speed(0x40, left);
            show_speed(0x44, right);
            show_way(0x49);
        }
    }
}
