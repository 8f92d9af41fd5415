/* Writes two lines: with FOUR over four wires and the busy flag, else over eight with delays. 11.0592 MHz. */
#include <8052.h>

#define RS P2_0
#define RW P2_1
#define E P2_2

static void wait_100_us(unsigned char times)
{
    while (times--) {
        unsigned char i = 23;
        while (--i) {
            RS = RS;
        }
    }
}

#ifdef FOUR

#define DATA P1 /* d4 to d7 on its upper half */

static void half(unsigned char value)
{
    DATA = (DATA & 0x0F) | (value & 0xF0);
    E = 1;
    E = 0;
}

static void wait(void)
{
    __bit busy;
    DATA |= 0xF0;
    RS = 0;
    RW = 1;
    do {
        E = 1;
        busy = DATA >> 7;
        E = 0;
        E = 1;
        E = 0;
    } while (busy);
    RW = 0;
}

static void write(unsigned char value, __bit data)
{
    wait();
    RS = data;
    half(value);
    half(value << 4);
}

#else

#define DATA P1

static void half(unsigned char value)
{
    DATA = value;
    E = 1;
    E = 0;
}

static void write(unsigned char value, __bit data)
{
    RS = data;
    half(value);
    wait_100_us(value < 4 && !data ? 20 : 1);
}

#endif

static void print(const char *text)
{
    while (*text) {
        write(*text++, 1);
    }
}

void main(void)
{
    E = 0;
    RS = 0;
    RW = 0;
    wait_100_us(160);
    half(0x30);
    wait_100_us(50);
    half(0x30);
    wait_100_us(2);
    half(0x30);
    wait_100_us(1);
#ifdef FOUR
    half(0x20);
    wait_100_us(1);
    write(0x28, 0);
#else
    write(0x38, 0);
#endif
    write(0x0C, 0);
    write(0x01, 0);
    write(0x06, 0);
    print("Hello, world");
    for (;;) {
        static unsigned int count = 0;
        write(0xC0, 0);
        print("count ");
        write('0' + count / 100 % 10, 1);
        write('0' + count / 10 % 10, 1);
        write('0' + count % 10, 1);
        count++;
        if (count == 300) {
            P3_7 = 0; /* enough */
            for (;;) {
            }
        }
    }
}
