/* A Modbus RTU module with eight coils, by "Modbus over Serial Line", V1.02, and "Modbus Application Protocol", V1.1b3.
 *
 * Functions: 01 read coils 0 to 7; 05 write a coil; 03 read and 06 write a register: 0 is the address (1 to 247), 1 the
 * rate (96: 9600 baud, 192: 19200), both in the EEPROM from the next start on. Address 0 is a broadcast: no answer.
 *
 * A frame ends where the line is silent for 3.5 characters. The driver of the RS485 line is enabled from before the
 * first bit of the answer to after its last.
 */
#include <8052.h>

#define OUTPUTS P1
#define SCL P3_2
#define SDA P3_3
#define OWN_SETTINGS P3_4
#define DRIVER_ENABLE P3_5

#define SILENCE_CYCLES 3700u /* 4 ms: 3.5 characters at 9600 baud are 4.0 ms */
#define LONGEST 16
#define MEMORY 0xA0
#define MARK 0x5A

static volatile __idata unsigned char frame[LONGEST + 1];
static volatile unsigned char length = 0;
static volatile __bit complete = 0;
static volatile __bit sent = 0;
static unsigned char address = 1;
static unsigned char rate = 96;
static unsigned char coils = 0;

static void restart_silence(void)
{
    TR0 = 0;
    TL0 = (unsigned char)(65536u - SILENCE_CYCLES);
    TH0 = (65536u - SILENCE_CYCLES) >> 8;
    TF0 = 0;
    TR0 = 1;
}

void silent(void) __interrupt(1)
{
    TR0 = 0;
    if (length)
        complete = 1;
}

void serial(void) __interrupt(4)
{
    unsigned char value;
    if (RI) {
        RI = 0;
        value = SBUF;
        if (!complete) {
            if (length <= LONGEST)
                frame[length++] = value; /* one more than fits: the frame is too long */
            restart_silence();
        }
    }
    if (TI) {
        TI = 0;
        sent = 1;
    }
}

/* EEPROM */

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

static __bit put(unsigned char value)
{
    unsigned char bits = 8;
    __bit refused;
    do {
        SDA = value >> 7;
        value <<= 1;
        SCL = 1;
        SCL = 0;
    } while (--bits);
    SDA = 1;
    SCL = 1;
    refused = SDA;
    SCL = 0;
    return refused;
}

static unsigned char get(void)
{
    unsigned char bits = 8, value = 0;
    SDA = 1;
    do {
        SCL = 1;
        value = value << 1 | SDA;
        SCL = 0;
    } while (--bits);
    SDA = 1; /* no acknowledge: the last byte */
    SCL = 1;
    SCL = 0;
    return value;
}

/* Selects a byte once the last write is over; the address is acknowledged then. */
static void select(unsigned char place)
{
    unsigned char tries = 255;
    for (;;) {
        start();
        if (!put(MEMORY) || !--tries)
            break;
        stop();
    }
    put(place);
}

static unsigned char load(unsigned char place)
{
    unsigned char value;
    select(place);
    start();
    put(MEMORY | 1);
    value = get();
    stop();
    return value;
}

static void store(unsigned char place, unsigned char value)
{
    select(place);
    put(value);
    stop();
}

/* Modbus */

static unsigned int crc(unsigned char count)
{
    unsigned int value = 0xFFFF;
    unsigned char index, bits;
    for (index = 0; index < count; index++) {
        value ^= frame[index];
        for (bits = 8; bits; bits--)
            value = value & 1 ? value >> 1 ^ 0xA001 : value >> 1;
    }
    return value;
}

static void answer(unsigned char count)
{
    unsigned char index;
    unsigned int sum = crc(count);
    frame[count++] = (unsigned char)sum;
    frame[count++] = sum >> 8;
    REN = 0;
    DRIVER_ENABLE = 1;
    for (index = 0; index < count; index++) {
        sent = 0;
        SBUF = frame[index];
        while (!sent)
            ;
    }
    for (index = 0; index < 60; index++) /* TI comes with the stop bit, which has to leave */
        ;
    DRIVER_ENABLE = 0;
    REN = 1;
}

static unsigned char refuse(unsigned char reason)
{
    frame[1] |= 0x80;
    frame[2] = reason;
    return 3;
}

static unsigned char read_coils(unsigned int first, unsigned int count)
{
    if (count == 0 || count > 8 || first > 7 || first + count > 8)
        return refuse(2);
    frame[2] = 1;
    frame[3] = coils >> first & (unsigned char)((1 << count) - 1);
    return 4;
}

static unsigned char write_coil(unsigned int which, unsigned int value)
{
    if (which > 7)
        return refuse(2);
    if (value != 0xFF00 && value != 0)
        return refuse(3);
    if (value)
        coils |= 1 << which;
    else
        coils &= ~(1 << which);
    OUTPUTS = ~coils;
    return 6;
}

static unsigned char read_registers(unsigned int first, unsigned int count)
{
    unsigned char index = 3;
    if (count == 0 || count > 2 || first > 1 || first + count > 2)
        return refuse(2);
    frame[2] = 2 * count;
    for (; count; count--, first++) {
        frame[index++] = 0;
        frame[index++] = first ? rate : address;
    }
    return index;
}

static unsigned char write_register(unsigned int which, unsigned int value)
{
    if (which > 1)
        return refuse(2);
    if (which == 0 ? value < 1 || value > 247 : value != 96 && value != 192)
        return refuse(3);
    store(1 + which, value);
    store(0, MARK);
    if (which)
        rate = value;
    else
        address = value;
    return 6;
}

static void handle(void)
{
    unsigned int first, second;
    unsigned char count;
    if (length != 8 || crc(6) != (frame[6] | (unsigned int)frame[7] << 8))
        return;
    if (frame[0] != address && frame[0] != 0)
        return;
    first = (unsigned int)frame[2] << 8 | frame[3];
    second = (unsigned int)frame[4] << 8 | frame[5];
    if (frame[1] == 1)
        count = read_coils(first, second);
    else if (frame[1] == 3)
        count = read_registers(first, second);
    else if (frame[1] == 5)
        count = write_coil(first, second);
    else if (frame[1] == 6)
        count = write_register(first, second);
    else
        count = refuse(1);
    if (frame[0])
        answer(count);
}

void main(void)
{
    DRIVER_ENABLE = 0;
    OUTPUTS = 0xFF;
    if (OWN_SETTINGS && load(0) == MARK) {
        address = load(1);
        rate = load(2);
    }
    TMOD = 0x21;
    TH1 = TL1 = 0xFD; /* 9600 baud */
    PCON = rate == 192 ? 0x80 : 0x00; /* SMOD doubles 9600 */
    SCON = 0x50;
    TR1 = 1;
    ET0 = 1;
    ES = 1;
    EA = 1;
    for (;;) {
        if (complete) {
            handle();
            EA = 0;
            length = 0;
            complete = 0;
            EA = 1;
        }
    }
}
