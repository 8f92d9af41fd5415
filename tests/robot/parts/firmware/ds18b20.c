/* Reads a DS18B20 again and again and sends its degrees, "missing", or "crc". 11.0592 or 12 MHz. */
#include <8052.h>

#define DQ P3_7

static void delay(unsigned char n) /* 2 cycles a turn, and 8 for the call */
{
    do {
    } while (--n);
}

static __bit reset(void)
{
    __bit missing;
    DQ = 0;
    delay(250);
    DQ = 1;
    delay(30);
    missing = DQ;
    delay(210);
    return missing;
}

static void write(unsigned char value)
{
    unsigned char i;
    for (i = 8; i; i--) {
        DQ = 0;
        DQ = value & 1;
        delay(30);
        DQ = 1;
        value >>= 1;
    }
}

static __bit read_bit(void)
{
    __bit bit;
    DQ = 0;
    DQ = 1;
    bit = DQ;
    delay(30);
    return bit;
}

static unsigned char read(void)
{
    unsigned char i, value = 0;
    for (i = 8; i; i--) {
        value >>= 1;
        if (read_bit()) {
            value |= 0x80;
        }
    }
    return value;
}

static unsigned char crc(unsigned char sum, unsigned char value)
{
    unsigned char i;
    sum ^= value;
    for (i = 8; i; i--) {
        sum = sum & 1 ? sum >> 1 ^ 0x8C : sum >> 1;
    }
    return sum;
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
}

static void print_degrees(int sixteenths)
{
    unsigned int tenths;
    if (sixteenths < 0) {
        put('-');
        sixteenths = -sixteenths;
    }
    tenths = ((unsigned int)sixteenths * 10 + 8) >> 4;
    put('0' + tenths / 100);
    put('0' + tenths / 10 % 10);
    put('.');
    put('0' + tenths % 10);
}

static void measure(void)
{
    unsigned char i, sum, low, high, value;
    if (reset()) {
        print("missing");
        return;
    }
    write(0xCC);
    write(0x44);
    while (!read_bit()) {
    }
    reset();
    write(0xCC);
    write(0xBE);
    low = read();
    high = read();
    sum = crc(crc(0, low), high);
    for (i = 2; i < 9; i++) {
        value = read();
        sum = crc(sum, value);
    }
    if (sum) {
        print("crc");
    } else {
        print_degrees(low | high << 8);
    }
}

void main(void)
{
    TMOD = 0x20;
    TH1 = 0xFD;
    TR1 = 1;
    SCON = 0x40;
    for (;;) {
        measure();
        put('\n');
    }
}
