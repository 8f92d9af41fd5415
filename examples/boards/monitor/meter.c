/* The meter of a power monitor. Channel 0 of the PCF8591 is the voltage, 1 V a step, channel 1 the current, 50 mA a step.
 *
 * Above 600 W the relay lets the load go and the buzzer sounds, until the next reset. `?` on the bus is answered by
 * voltage, current and whether the load is on: four bytes, the last the sum of the others.
 */
#include <8052.h>

#define RELAY P1_0  /* low: the load is on */
#define BUZZER P1_1 /* low: it sounds */
#define SCL P3_2
#define SDA P3_3
#define DRIVER_ENABLE P3_5

#define ADC 0x90
#define MOST_POWER 12000u /* 600 W in steps of 1 V * 50 mA */
#define TURN_CYCLES 1000u /* 1.1 ms, in which who asked leaves the bus */

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

static void put(unsigned char value)
{
    unsigned char bits = 8;
    do {
        SDA = value >> 7;
        value <<= 1;
        SCL = 1;
        SCL = 0;
    } while (--bits);
    SDA = 1;
    SCL = 1; /* acknowledge */
    SCL = 0;
}

static unsigned char get(__bit last)
{
    unsigned char bits = 8, value = 0;
    SDA = 1;
    do {
        SCL = 1;
        value = value << 1 | SDA;
        SCL = 0;
    } while (--bits);
    SDA = last;
    SCL = 1;
    SCL = 0;
    return value;
}

static unsigned char convert(unsigned char channel)
{
    unsigned char value;
    start();
    put(ADC);
    put(channel);
    start();
    put(ADC | 1);
    get(0); /* that of the conversion before */
    value = get(1);
    stop();
    return value;
}

static void send(unsigned char value)
{
    SBUF = value;
    while (!TI)
        ;
    TI = 0;
}

static void wait(void)
{
    TR0 = 0;
    TL0 = (unsigned char)(65536u - TURN_CYCLES);
    TH0 = (65536u - TURN_CYCLES) >> 8;
    TF0 = 0;
    TR0 = 1;
    while (!TF0)
        ;
}

void main(void)
{
    unsigned char voltage, current;
    DRIVER_ENABLE = 0;
    RELAY = 0;
    TMOD = 0x21;
    TH1 = TL1 = 0xFD; /* 9600 */
    TR1 = 1;
    SCON = 0x50;
    for (;;) {
        voltage = convert(0);
        current = convert(1);
        if ((unsigned int)voltage * current > MOST_POWER) {
            RELAY = 1;
            BUZZER = 0;
        }
        if (RI) {
            RI = 0;
            if (SBUF == '?') {
                wait();
                DRIVER_ENABLE = 1;
                send(voltage);
                send(current);
                send(!RELAY);
                send(voltage + current + !RELAY);
                wait(); /* the last stop bit */
                DRIVER_ENABLE = 0;
            }
        }
    }
}
