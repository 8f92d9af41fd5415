/* The panel of a power monitor: asks the meter ten times a second, and shows what it answers.
 *
 *     U 230V I 2.50A       `no answer` once the meter is silent, or its sum is wrong
 *     P  575W on
 */
#include <8052.h>

#define LCD P1 /* d4 to d7 on its upper half */
#define RS P1_0
#define RW P1_1
#define E P1_2
#define DRIVER_ENABLE P3_5

#define TICK_CYCLES 9216u /* 10 ms */
#define TURN_TICKS 1      /* until the last stop bit is over */
#define ANSWER_TICKS 3
#define PAUSE_TICKS 6

static unsigned char answer[4];

static void start_tick(void)
{
    TR0 = 0;
    TL0 = (unsigned char)(65536u - TICK_CYCLES);
    TH0 = (65536u - TICK_CYCLES) >> 8;
    TF0 = 0;
    TR0 = 1;
}

static void wait(unsigned char ticks)
{
    do {
        start_tick();
        while (!TF0)
            ;
    } while (--ticks);
}

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

static void put(__bit data, unsigned char value)
{
    wait_display();
    RS = data;
    put_nibble(value);
    put_nibble(value << 4);
}

static void show(__code const char *text)
{
    while (*text)
        put(1, *text++);
}

/* Three digits, leading zeros as `blank`. */
static void show_number(unsigned int value, char blank)
{
    unsigned int unit = 100;
    unsigned char digit;
    do {
        digit = value / unit % 10;
        if (digit || unit == 1)
            blank = '0';
        put(1, digit || blank == '0' ? '0' + digit : blank);
        unit /= 10;
    } while (unit);
}

static void begin_display(void)
{
    E = 0; /* while RW is still high: nothing is written */
    wait(5);
    RW = 0;
    RS = 0;
    put_nibble(0x30);
    wait(1);
    put_nibble(0x30);
    wait(1);
    put_nibble(0x30);
    wait(1);
    put_nibble(0x20);
    wait(1);
    put(0, 0x28);
    put(0, 0x0C);
    put(0, 0x01);
}

/* Whether the meter has answered. */
static __bit ask(void)
{
    unsigned char count = 0, ticks = ANSWER_TICKS;
    DRIVER_ENABLE = 1;
    SBUF = '?';
    while (!TI)
        ;
    TI = 0;
    for (count = 60; count; count--)
        ; /* the stop bit: 96 cycles */
    DRIVER_ENABLE = 0;
    count = 0;
    start_tick();
    while (ticks) {
        if (RI) {
            RI = 0;
            answer[count++] = SBUF;
            if (count == 4)
                return answer[3] == (unsigned char)(answer[0] + answer[1] + answer[2]);
        }
        if (TF0) {
            ticks--;
            start_tick();
        }
    }
    return 0;
}

static void show_answer(void)
{
    unsigned int hundredths = 5 * answer[1];
    unsigned int watts = (unsigned int)answer[0] * answer[1] / 20;
    put(0, 0x80);
    show("U ");
    show_number(answer[0], ' ');
    show("V I ");
    put(1, '0' + hundredths / 100 % 10);
    put(1, '.');
    put(1, '0' + hundredths / 10 % 10);
    put(1, '0' + hundredths % 10);
    show("A  ");
    put(0, 0xC0);
    show("P ");
    show_number(watts, ' ');
    show(answer[2] ? "W on      " : "W off     ");
}

void main(void)
{
    DRIVER_ENABLE = 0;
    TMOD = 0x21;
    TH1 = TL1 = 0xFD; /* 9600 */
    TR1 = 1;
    SCON = 0x50;
    begin_display();
    for (;;) {
        if (ask())
            show_answer();
        else {
            put(0, 0x80);
            show("no answer       ");
        }
        wait(PAUSE_TICKS);
    }
}
