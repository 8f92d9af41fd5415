/* Reads the four inputs of a PCF8591 and sends them as volts; its output follows the first one. 11.0592 or 12 MHz. */
#include <8052.h>

#define SCL P2_0
#define SDA P2_1

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

static void print_volts(unsigned char steps) /* 256 are 5 V */
{
    unsigned int hundredths = (steps * 125u + 32) >> 6;
    put('0' + hundredths / 100);
    put('.');
    put('0' + hundredths / 10 % 10);
    put('0' + hundredths % 10);
    put(' ');
}

void main(void)
{
    unsigned char i, output = 0;
    unsigned char volts[4];
    TMOD = 0x20;
    TH1 = 0xFD;
    TR1 = 1;
    SCON = 0x40;
    for (;;) {
        start();
        send(0x90);
        send(0x44); /* output on, count up from channel 0 */
        send(output);
        stop();
        start();
        send(0x91);
        receive(0); /* the conversion of before */
        for (i = 0; i < 4; i++) {
            volts[i] = receive(i == 3);
        }
        stop();
        for (i = 0; i < 4; i++) {
            print_volts(volts[i]);
        }
        put('\n');
        output = volts[0];
    }
}
