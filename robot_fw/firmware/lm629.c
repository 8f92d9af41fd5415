/* The bus of the two LM629: P0 carries the bytes, P2 the strobes.
 *
 * What belongs here: bus cycles, busy polling, the reset handshake. What does not: which trajectory to load
 * (motion.c). A step of the CPU is 500 ns or more, which meets every limit of the data sheet's timing page (read
 * access 180 ns, write pulse 100 ns, data hold 120 ns, recovery 120 ns).
 *
 * The busy bit of every selected chip is polled before each command and each word. A chip that stays busy far longer
 * than the data sheet's 100 us is broken or absent: then both are held in reset, which switches both motors off, and
 * `lm629_ready` is cleared.
 */

#include "lm629.h"

#define STATUS_BUSY     0x01
#define STATUS_BOOT     0x84    /* motor off, trajectory complete; bit 6 does not matter */
#define STATUS_READY    0x80
#define STATUS_BIT6     0x40

#define BUSY_POLLS      25      /* 16 us each: four times the 100 us that a chip may take */
#define BOOT_POLLS      200     /* 17 us each: twice the 1.5 ms that a chip may take */

__bit lm629_ready;
static u8 selected;

void lm629_select(u8 chips)
{
    selected = chips;
}

/* One read cycle of one chip. P0 is released (FFh) whenever no write is under way. */
static u8 read_cycle(u8 chip)
{
    u8 value;

    LM629_CONTROL &= chip;
    LM629_RD = 0;
    value = LM629_DATA;
    LM629_RD = 1;
    LM629_CONTROL |= LM629_SELECTS;
    return value;
}

/* One write cycle of all selected chips; /WR rises while data and selects still stand. */
static void write_cycle(u8 value)
{
    LM629_DATA = value;
    LM629_CONTROL &= selected;
    LM629_WR = 0;
    LM629_WR = 1;
    LM629_CONTROL |= LM629_SELECTS;
    LM629_DATA = 0xFF;
}

/* Status byte: allowed at any time, busy or not. */
u8 lm629_status(u8 chip)
{
    LM629_PS = 0;
    return read_cycle(chip);
}

static void give_up(void)
{
    LM629_RST = 0;
    lm629_ready = 0;
}

static bool wait_for(u8 chip)
{
    u8 polls = BUSY_POLLS;

    while (lm629_status(chip) & STATUS_BUSY) {
        if (!--polls) {
            give_up();
            return false;
        }
    }
    return true;
}

/* True when all selected chips may be written. */
static bool free_to_go(void)
{
    if (!lm629_ready)
        return false;
    if (selected != RIGHT && !wait_for(LEFT))
        return false;
    return selected == LEFT || wait_for(RIGHT);
}

void lm629_command(u8 opcode)
{
    if (!free_to_go())
        return;
    LM629_PS = 0;
    write_cycle(opcode);
}

/* Between the two bytes of a word no busy test is needed. */
void lm629_word(u8 high, u8 low)
{
    if (!free_to_go())
        return;
    LM629_PS = 1;
    write_cycle(high);
    write_cycle(low);
}

/* The next word of a reading command, from the one chip that is selected; 0 when it does not answer. */
u16 lm629_read_word(void)
{
    u8 high;

    if (!free_to_go())
        return 0;
    LM629_PS = 1;
    high = read_cycle(selected);
    return (u16)high << 8 | read_cycle(selected);
}

static bool boots(u8 chip)
{
    u8 polls = BOOT_POLLS;

    while ((lm629_status(chip) & ~STATUS_BIT6) != STATUS_BOOT) {
        if (!--polls)
            return false;
    }
    return true;
}

static bool handshake(void)
{
    /* One access in between outlasts the 8 LM629 clocks (1.33 us) that RST must be low. */
    LM629_RST = 0;
    lm629_status(LEFT);
    LM629_RST = 1;
    if (!boots(LEFT) || !boots(RIGHT))
        return false;
    lm629_ready = 1;
    lm629_select(BOTH);
    lm629_command(RSTI);
    lm629_word(0, 0);
    if (!free_to_go())
        return false;
    return (lm629_status(LEFT) & ~STATUS_BIT6) == STATUS_READY
        && (lm629_status(RIGHT) & ~STATUS_BIT6) == STATUS_READY;
}

/* Resets both chips until both show 84h or C4h, then 80h or C0h after RSTI. After `tries` failures it leaves them in
 * reset, motors off, and returns false. */
bool lm629_reset(u8 tries)
{
    do {
        if (handshake())
            return true;
    } while (--tries);
    give_up();
    return false;
}
