/* Minutes and seconds on four digits, a thousand digits a second by timer 2. 11.0592 MHz; begins at 12:34.
 * Two 74HC595 in a row: digits, then segments; with -DMODE0 by the serial port. With -DPORTS segments on P0, digits on P2.0 to P2.3 by transistors. */
#include <8052.h>

#define SER P1_0
#define SRCLK P1_1
#define RCLK P1_2

static __code const unsigned char codes[10] = {0x3F, 0x06, 0x5B, 0x4F, 0x66, 0x6D, 0x7D, 0x07, 0x7F, 0x6F};
static volatile unsigned char shown[4];
static volatile __bit a_second;

#pragma save
#pragma nooverlay /* the interrupt calls these while a division has its numbers in the shared bytes */
#ifdef PORTS
static void light(unsigned char segments, unsigned char digit)
{
    P2 = 0xFF;
    P0 = ~segments;
    P2 = ~(1 << digit);
}
#else
static void shift(unsigned char value)
{
#ifdef MODE0
    TI = 0;
    SBUF = value;
    while (!TI) {
    }
#else
    unsigned char i;
    for (i = 8; i; i--) {
        SER = value >> 7;
        SRCLK = 1;
        SRCLK = 0;
        value <<= 1;
    }
#endif
}

static void light(unsigned char segments, unsigned char digit)
{
    shift(~(1 << digit));
    shift(segments);
    RCLK = 1;
    RCLK = 0;
}
#endif
#pragma restore

void tick(void) __interrupt(5)
{
    static unsigned char digit;
    static unsigned int ticks;
    TF2 = 0;
    light(shown[digit], digit);
    digit = (digit + 1) & 3;
    if (++ticks == 1000) {
        ticks = 0;
        a_second = 1;
    }
}

void main(void)
{
    unsigned char minutes = 12, seconds = 34;
    SRCLK = 0;
    RCLK = 0;
    RCAP2H = (65536 - 922) >> 8; /* 1 ms */
    RCAP2L = (65536 - 922) & 0xFF;
    TR2 = 1;
    ET2 = 1;
    EA = 1;
    for (;;) {
        shown[0] = minutes < 10 ? 0 : codes[minutes / 10];
        shown[1] = codes[minutes % 10] | 0x80;
        shown[2] = codes[seconds / 10];
        shown[3] = codes[seconds % 10];
        while (!a_second) {
        }
        a_second = 0;
        if (++seconds == 60) {
            seconds = 0;
            minutes++;
        }
    }
}
