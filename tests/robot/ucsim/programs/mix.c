/* A mix of what C compilers make of an 8051: 32-bit arithmetic, division, shifts, bit and
   bit-field access, pointers into every memory, function pointers, recursion, floating point. */

#include <8052.h>
#include <stdint.h>

static __code const uint8_t text[] = "the quick brown fox jumps over the lazy dog";
static __idata uint8_t heap[48];
static __xdata uint16_t far[256];
static __bit flip;
static uint32_t noise = 1;
static float mean;
static volatile uint16_t result;

static uint16_t random16(void)
{
    noise = noise * 1664525UL + 1013904223UL;
    return noise >> 16;
}

static uint16_t crc(const uint8_t *data, uint8_t size)
{
    uint16_t sum = 0xFFFF;
    uint8_t bit;

    while (size--) {
        sum ^= *data++;
        for (bit = 0; bit < 8; bit++)
            sum = sum & 1 ? sum >> 1 ^ 0xA001 : sum >> 1;
    }
    return sum;
}

static void sort(void)
{
    uint8_t i, j, key;

    for (i = 1; i < sizeof heap; i++) {
        key = heap[i];
        for (j = i; j && heap[j - 1] > key; j--)
            heap[j] = heap[j - 1];
        heap[j] = key;
    }
}

static uint8_t depth(uint8_t n) __reentrant
{
    return n < 2 ? n : depth(n - 1) + depth(n - 2);
}

static int16_t twice(int16_t n) { return n + n; }
static int16_t third(int16_t n) { return n / 3 - n % 7; }
static int16_t (*const __code table[])(int16_t) = {twice, third};

void main(void)
{
    uint8_t i;

    for (;;) {
        for (i = 0; i < sizeof heap; i++)
            heap[i] = random16();
        result = crc(text, sizeof text) ^ crc(heap, sizeof heap);
        sort();
        for (i = 0; i < 64; i++)
            far[i + (heap[i & 31] & 63)] = noise / (random16() | 1) + noise % 1000;
        flip = !flip;
        mean = mean * 0.875f + (float)heap[24] / (flip ? 3.0f : 7.0f);
        result += table[random16() & 1]((int16_t)random16()) + depth(7) + (int16_t)mean;
        P1 = result;
    }
}
