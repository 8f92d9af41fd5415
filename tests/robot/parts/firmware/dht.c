/* Asks a DHT11 each second, or with -DDHT22 its finer sister each two, and sends its bytes, "silent", or "sum". */
#include <8052.h>

#define DATA P1_3
#ifdef DHT22
#define START_MS 1
#define PERIOD_MS 2020
#else
#define START_MS 20
#define PERIOD_MS 1010
#endif

static unsigned char values[5];

static void delay(unsigned char n) /* 2 cycles a turn, and 8 for the call */
{
    do {
    } while (--n);
}

static void wait_ms(unsigned int ms) /* 1.01 ms each at 12 MHz */
{
    while (ms--) {
        delay(250);
        delay(240);
    }
}

#define WAIT_WHILE(condition)                                                                                          \
    for (patience = 40; condition; patience--) {                                                                       \
        if (!patience) {                                                                                               \
            return 1;                                                                                                  \
        }                                                                                                              \
    }

static __bit ask(void)
{
    unsigned char i, n, patience, value;
    DATA = 0;
    wait_ms(START_MS);
    DATA = 1;
    WAIT_WHILE(DATA)
    WAIT_WHILE(!DATA)
    WAIT_WHILE(DATA)
    for (n = 0; n < 5; n++) {
        value = 0;
        for (i = 8; i; i--) {
            WAIT_WHILE(!DATA)
            delay(8); /* with what stands around it: 40 us into the high */
            value <<= 1;
            if (DATA) {
                value |= 1;
                WAIT_WHILE(DATA)
            }
        }
        values[n] = value;
    }
    return 0;
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

void main(void)
{
    unsigned char i;
    TMOD = 0x20;
    TH1 = 0xFD;
    TR1 = 1;
    SCON = 0x40;
    for (;;) {
        if (ask()) {
            print("silent");
        } else if (values[4] != (unsigned char)(values[0] + values[1] + values[2] + values[3])) {
            print("sum");
        } else {
            for (i = 0; i < 4; i++) {
                put("0123456789abcdef"[values[i] >> 4]);
                put("0123456789abcdef"[values[i] & 15]);
            }
        }
        put('\n');
        wait_ms(PERIOD_MS);
    }
}
