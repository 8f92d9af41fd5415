#include <8052.h>
#define LAMP P1_3
#define KEY P3_2
#define PWM P2_0

static volatile unsigned char ticks, phase;
static unsigned char counts, pressed, duty = 3;

void tick(void) __interrupt(1)
{
    TH0 = 0xFC; TL0 = 0x66; /* 1 ms at 11.0592 MHz */
    ticks++;
    if (++phase == 10)
        phase = 0;
    PWM = phase < duty;
    if (ticks % 50 == 0)
        LAMP = !LAMP;
}

static void put(char c)
{
    SBUF = c;
    while (!TI)
        ;
    TI = 0;
}

static void say(__code const char *text)
{
    while (*text)
        put(*text++);
}

void main(void)
{
    TMOD = 0x21; TH1 = 0xFD; SCON = 0x50; TR1 = 1;
    TH0 = 0xFC; TL0 = 0x66; TR0 = 1; ET0 = 1; EA = 1;
    say("ready\r\n");
    for (;;) {
        if (RI) {
            char c = SBUF;
            RI = 0;
            if (c == '?')
                say("count 7\r\n");
            else if (c == 's')
                duty = 0;
            else if (c == 'g')
                duty = 5;
        }
        if (!KEY && !pressed) {
            pressed = 1;
            counts++;
            put('k'); put('0' + counts); put('\n');
        }
        if (KEY)
            pressed = 0;
    }
}
