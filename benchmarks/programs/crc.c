/* CRC-16 bit by bit and CRC-32 by nibble table over a block in external RAM. */

#include "bench.h"

static __xdata uint8_t block[256];
static const __code uint32_t table[16] = {
    0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
    0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
};

static uint16_t crc16(const __xdata uint8_t *data, uint8_t size)
{
    uint16_t crc = 0xFFFF;
    uint8_t bit;

    while (size--) {
        crc ^= *data++;
        for (bit = 0; bit < 8; bit++)
            crc = crc & 1 ? crc >> 1 ^ 0xAC9A : crc >> 1;
    }
    return ~crc;
}

static uint32_t crc32(const __xdata uint8_t *data, uint8_t size)
{
    uint32_t crc = 0xFFFFFFFF;

    while (size--) {
        crc ^= *data++;
        crc = crc >> 4 ^ table[crc & 15];
        crc = crc >> 4 ^ table[crc & 15];
    }
    return ~crc;
}

void main(void)
{
    uint16_t round;

    start();
    for (round = 0; round < 600; round++) {
        block[round & 255] += round ^ checksum;
        checksum = crc32(block, 255) + crc16(block, 255);
    }
    finish();
}
