/* What programs of csmith need, instead of its own headers, which ask for printf: a checksum that leaves on the UART. */

#include <8052.h>
#include <stdint.h>

static uint32_t crc32_context = 0xFFFFFFFFUL;

static void put(uint8_t byte)
{
    while (!TI)
        ;
    TI = 0;
    SBUF = byte;
}

static void transparent(uint32_t value)
{
    uint8_t bit;

    crc32_context ^= value;
    for (bit = 0; bit != 32; ++bit)
        crc32_context = crc32_context & 1 ? crc32_context >> 1 ^ 0xEDB88320UL : crc32_context >> 1;
    put(crc32_context);
}

#define printf(...) ((void)0) /* of indices, behind a flag that is 0 */

#define transparent_crc(value, name, flag) transparent((uint32_t)(value))

static void crc32_gentab(void)
{
}

static void platform_main_begin(void)
{
    SCON = 0x50;
    TMOD = 0x20;
    TH1 = TL1 = 0xFF;
    TR1 = 1;
    TI = 1;
}

void finished(void)
{
    for (;;)
        ;
}

static void platform_main_end(uint32_t crc, int flag)
{
    (void)flag;
    put(crc);
    put(crc >> 8);
    put(crc >> 16);
    put(crc >> 24);
    while (!TI)
        ;
    finished();
}
