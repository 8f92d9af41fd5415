/* Holds a relay while input 0 of a PCF8591 is below 3 V, and sends what its contact does. 11.0592 MHz. */
#include <8052.h>

#define SCL P2_0
#define SDA P2_1
#define COIL P1_7    /* active low */
#define CONTACT P1_6 /* to ground */

static void pause(void) /* more than 4.7 us with the call */
{
    __asm__("nop\nnop\nnop");
}

static void start(void)
{
    SDA = 1;
    SCL = 1;
    pause();
    SDA = 0;
    pause();
    SCL = 0;
}

static void stop(void)
{
    SDA = 0;
    pause();
    SCL = 1;
    pause();
    SDA = 1;
}

static __bit bit(__bit level)
{
    __bit seen;
    SDA = level;
    pause();
    SCL = 1;
    pause();
    seen = SDA;
    SCL = 0;
    return seen;
}

static void send(unsigned char value)
{
    unsigned char i;
    for (i = 8; i; i--) {
        bit(value & 0x80);
        value <<= 1;
    }
    bit(1);
}

static unsigned char receive(__bit last)
{
    unsigned char i, value = 0;
    for (i = 8; i; i--) {
        value = value << 1 | bit(1);
    }
    bit(last);
    return value;
}

static void put(unsigned char value)
{
    SBUF = value;
    while (!TI) {
    }
    TI = 0;
}

static void print(__code const char *text)
{
    while (*text) {
        put(*text++);
    }
    put('\n');
}

static unsigned char measure(void)
{
    unsigned char steps;
    start();
    send(0x90);
    send(0x00);
    start();
    send(0x91);
    receive(0); /* the conversion of before */
    steps = receive(1);
    stop();
    return steps;
}

static void wait_ms(unsigned char ms)
{
    while (ms--) {
        TH0 = (65536 - 921) >> 8;
        TL0 = (65536 - 921) & 0xFF;
        TF0 = 0;
        while (!TF0) {
        }
    }
}

void main(void)
{
    unsigned char state = 2;
    TMOD = 0x21;
    TH1 = 0xFD;
    TR0 = TR1 = 1;
    SCON = 0x40;
    for (;;) {
        COIL = measure() >= 154; /* 3 V */
        wait_ms(12);
        if (CONTACT == COIL && state != COIL) {
            state = COIL;
            print(state ? "off" : "on");
        } else if (CONTACT != COIL && state != 3) {
            state = 3;
            print("stuck");
        }
    }
}
