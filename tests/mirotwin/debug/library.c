/* What SDCC's library and calling conventions do to a stack: formatted output, sorting by a function that a pointer
   names, memory from a heap, floating point, recursion with a frame pointer, two interrupts of different priority. */

#include <8052.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static volatile uint16_t ticks;
static volatile uint8_t fast, sent;
static __xdata char text[40];
static __xdata int16_t numbers[12];

static uint16_t spread(uint16_t n) __reentrant { return n * 7 + 3; }

void slow_tick(void) __interrupt (1)
{
    ticks = ticks + spread(ticks);
}

void fast_tick(void) __interrupt (5) __using (1)
{
    TF2 = 0;
    ++fast;
}

int putchar(int character)
{
    sent += (uint8_t)character;
    return character;
}

static int smaller(const void *left, const void *right) __reentrant
{
    return *(const int16_t *)left - *(const int16_t *)right;
}

static uint16_t power(uint16_t base, uint8_t exponent) __reentrant
{
    uint8_t room[4];

    room[exponent & 3] = exponent;
    return exponent ? base * power(base, exponent - 1) + room[exponent & 3] : 1;
}

static uint8_t kind(uint8_t n)
{
    switch (n) {
    case 0: return sent;
    case 1: return fast;
    case 2: return spread(n);
    case 3: return power(3, 4);
    case 4: return 9;
    case 5: return sent ^ fast;
    default: return n;
    }
}

void main(void)
{
    uint8_t i;
    char *copy;
    float mean = 0;

    TMOD = 0x02;
    TH0 = 0x1B;
    RCAP2L = 0x31;
    RCAP2H = 0xFF;
    PT2 = 1;
    TR0 = TR2 = ET0 = ET2 = EA = 1;
    for (;;) {
        for (i = 0; i < 12; ++i) {
            numbers[i] = rand();
            mean = (mean + numbers[i]) / 2.0f;
        }
        qsort(numbers, 12, sizeof numbers[0], smaller);
        sprintf(text, "%d %s %ld", numbers[0], "to", (long)numbers[11] * ticks);
        printf("%u %x\n", ticks, (unsigned)mean);
        copy = malloc(strlen(text) + 1);
        if (copy) {
            strcpy(copy, text);
            P1 = power(copy[0], 5) + kind(copy[1] & 7);
            free(copy);
        }
    }
}
