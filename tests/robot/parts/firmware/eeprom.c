/* Writes a page of a 24C02 over two port pins, waits by asking, reads it back and sends what it has read. 11.0592 MHz. */
#include <8052.h>

#define SCL P2_0
#define SDA P2_1

static void start(void)
{
    SDA = 1;
    SCL = 1;
    SDA = 0;
    SCL = 0;
}

static void stop(void)
{
    SDA = 0;
    SCL = 1;
    SDA = 1;
}

static __bit send(unsigned char value)
{
    unsigned char i;
    __bit missing;
    for (i = 8; i; i--) {
        SDA = value >> 7;
        SCL = 1;
        value <<= 1;
        SCL = 0;
    }
    SDA = 1;
    SCL = 1;
    missing = SDA;
    SCL = 0;
    return missing;
}

static unsigned char receive(__bit last)
{
    unsigned char i, value = 0;
    for (i = 8; i; i--) {
        SDA = 1;
        SCL = 1;
        value <<= 1;
        value |= SDA;
        SCL = 0;
    }
    SDA = last;
    SCL = 1;
    SCL = 0;
    return value;
}

static void put(unsigned char value)
{
    SBUF = value;
    while (!TI) {
    }
    TI = 0;
}

void main(void)
{
    unsigned char i, polls = 0;
    TMOD = 0x20;
    TH1 = 0xFD;
    TR1 = 1;
    SCON = 0x40;
    start();
    if (send(0xA0) | send(0x10)) {
        put('?');
    }
    for (i = 0; i < 8; i++) {
        send('a' + i);
    }
    stop();
    for (;;) {
        start();
        if (!send(0xA0)) {
            break;
        }
        stop();
        polls++;
    }
    send(0x12);
    start();
    send(0xA1);
    for (i = 0; i < 4; i++) {
        put(receive(i == 3));
    }
    stop();
    put(polls > 10 ? 'y' : 'n');
    put('\n');
    for (;;) {
    }
}
