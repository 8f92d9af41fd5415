/* A rover: it drives ahead; below 1 m it goes back for 1 s and turns right for 2 s. The display shows the distance and
 * what it does, three LEDs the same, and the serial port sends a letter at each change: A ahead, B back, R right, S stop.
 * `p` pauses it, `c` lets it continue.
 */
#include <8052.h>

#define LCD P1 /* d4 to d7 on its upper half */
#define RS P1_0
#define RW P1_1
#define E P1_2
#define TRIG P2_3
#define ECHO P2_4
#define LED_AHEAD P2_5
#define LED_BACK P2_6
#define LED_TURN P2_7

#define CYCLES_PER_CM 53u /* 58 us at 921.6 kHz, rounded down */
#define NO_ECHO 0xFFFFu
#define NEAR_CM 100u
#define TICK_CYCLES 9216u /* 10 ms */
#define BACK_TICKS 100
#define TURN_TICKS 200

enum { STOP, AHEAD, BACK, RIGHT };

static volatile unsigned int ticks = 0;
static volatile __bit paused = 0;
static unsigned char doing = STOP;

void clock(void) __interrupt(1)
{
    TL0 = (unsigned char)(65536u - TICK_CYCLES + 10);
    TH0 = (65536u - TICK_CYCLES + 10) >> 8;
    ticks++;
}

void serial(void) __interrupt(4)
{
    unsigned char letter;
    if (!RI)
        return;
    RI = 0;
    letter = SBUF;
    if (letter == 'p')
        paused = 1;
    else if (letter == 'c')
        paused = 0;
}

static unsigned int time(void)
{
    unsigned int now;
    ET0 = 0; /* two bytes that the interrupt changes */
    now = ticks;
    ET0 = 1;
    return now;
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

/* Display */

static void put_nibble(unsigned char value)
{
    LCD = (LCD & 0x0F) | (value & 0xF0);
    E = 1;
    E = 0;
}

static void wait_display(void)
{
    unsigned char busy;
    RS = 0;
    LCD |= 0xF0; /* inputs */
    RW = 1;
    do {
        E = 1;
        busy = LCD & 0x80;
        E = 0;
        E = 1; /* the lower half of the address */
        E = 0;
    } while (busy);
    RW = 0;
}

static void command(unsigned char value)
{
    wait_display();
    RS = 0;
    put_nibble(value);
    put_nibble(value << 4);
}

static void put_character(char value)
{
    wait_display();
    RS = 1;
    put_nibble(value);
    put_nibble(value << 4);
    RS = 0;
}

static void pause(unsigned char ten_ms)
{
    unsigned int begun = time();
    while (time() - begun < ten_ms)
        ;
}

static void start_display(void)
{
    RS = 0;
    RW = 0;
    E = 0;
    pause(5);
    put_nibble(0x30);
    pause(2);
    put_nibble(0x30);
    pause(2);
    put_nibble(0x30);
    pause(2);
    put_nibble(0x20); /* four bits from here on */
    pause(2);
    command(0x28);
    command(0x0C);
    command(0x01);
    command(0x06);
}

static void show(const char *text)
{
    while (*text)
        put_character(*text++);
}

static void show_distance(unsigned int cm)
{
    unsigned char place;
    unsigned int unit = 100;
    command(0x80);
    if (cm == NO_ECHO) {
        show("--- cm");
        return;
    }
    for (place = 0; place < 3; place++) {
        put_character('0' + cm / unit % 10);
        unit /= 10;
    }
    show(" cm");
}

/* Driving */

static void go(unsigned char where)
{
    if (where == doing)
        return;
    P0 = (P0 & 0xF0) | (where == AHEAD ? 0x05 : where == BACK ? 0x0A : where == RIGHT ? 0x09 : 0x00);
    doing = where;
    LED_AHEAD = where != AHEAD;
    LED_BACK = where != BACK;
    LED_TURN = where != RIGHT;
    command(0xC0);
    show(where == AHEAD ? "ahead" : where == BACK ? "back " : where == RIGHT ? "right" : "stop ");
    say("SABR"[where]);
}

static unsigned int now(void)
{
    unsigned char high, low;
    do {
        high = TH2;
        low = TL2;
    } while (high != TH2);
    return (unsigned int)high << 8 | low;
}

static unsigned int ping(void)
{
    unsigned int begun, rise;
    TRIG = 1;
    begun = now();
    while (now() - begun < 12)
        ;
    TRIG = 0;
    begun = now();
    while (!ECHO)
        if (now() - begun > 36000u)
            return NO_ECHO;
    rise = now();
    while (ECHO)
        if (now() - rise > 36000u)
            return NO_ECHO;
    rise = now() - rise;
    return rise > 33000u ? NO_ECHO : rise / CYCLES_PER_CM;
}

static void drive_for(unsigned char where, unsigned int for_ticks)
{
    unsigned int begun = time();
    go(where);
    while (!paused && time() - begun < for_ticks)
        ;
}

void main(void)
{
    unsigned int distance_cm;
    P0 = 0xF0;
    TRIG = 0;
    TMOD = 0x21;
    TH1 = TL1 = 0xFD; /* 9600 baud */
    SCON = 0x50;
    T2CON = 0x04;
    RCAP2L = RCAP2H = 0;
    TR1 = 1;
    TR0 = 1;
    ET0 = 1;
    ES = 1;
    EA = 1;
    start_display();
    doing = RIGHT;
    go(STOP);
    for (;;) {
        distance_cm = ping();
        show_distance(distance_cm);
        if (paused || distance_cm == NO_ECHO)
            go(STOP);
        else if (distance_cm < NEAR_CM) {
            drive_for(BACK, BACK_TICKS);
            drive_for(RIGHT, TURN_TICKS);
        } else
            go(AHEAD);
        pause(6);
    }
}
