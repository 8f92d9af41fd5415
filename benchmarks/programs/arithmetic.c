/* Fixed-point and 32-bit arithmetic: a Q15 filter, multiplication, division and an integer square root. */

#include "bench.h"

#define TAPS 8

static const __code int16_t taps[TAPS] = {310, -1206, 2713, 14561, 14561, 2713, -1206, 310};
static __idata int16_t line[TAPS];

static int16_t filter(int16_t sample)
{
    uint8_t i;
    int32_t sum = 0x4000;

    for (i = TAPS - 1; i; i--)
        line[i] = line[i - 1];
    line[0] = sample;
    for (i = 0; i < TAPS; i++)
        sum += (int32_t)line[i] * taps[i];
    return sum >> 15;
}

static uint16_t root(uint32_t square)
{
    uint32_t bit = 0x40000000, result = 0;

    while (bit) {
        if (square >= result + bit) {
            square -= result + bit;
            result = (result >> 1) + bit;
        } else
            result >>= 1;
        bit >>= 2;
    }
    return result;
}

void main(void)
{
    uint16_t round;
    uint32_t noise = 1;
    int16_t x, y;

    start();
    for (round = 0; round < 9000; round++) {
        noise = noise * 1664525UL + 1013904223UL;
        x = noise >> 16;
        y = filter(x);
        checksum += noise / ((uint16_t)x | 1) + noise % 1000;
        checksum ^= root((int32_t)x * x + (int32_t)y * y);
    }
    finish();
}
