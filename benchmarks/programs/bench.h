/* What the three programs have in common: a timer interrupt every millisecond, and a place to end. `checksum` is
   the result that all machines must agree on; `ticks` is not: ucsim has other interrupt latencies. */

#include <8052.h>
#include <stdint.h>

volatile uint32_t checksum;
volatile uint16_t ticks;

void tick(void) __interrupt(5)
{
    TF2 = 0;
    ticks++;
}

static void start(void)
{
    RCAP2L = 0x30; /* 65536 - 2000 */
    RCAP2H = 0xF8;
    T2CON = 0x04;
    ET2 = 1;
    EA = 1;
}

void finish(void)
{
    for (;;)
        ;
}
