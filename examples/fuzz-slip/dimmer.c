/* A dimmer for three lamps on an AT89C52 at 11.0592 MHz, 19200 baud: takes SLIP frames (RFC 1055) with a Fletcher-16.

   What belongs here: the whole firmware. What does not: the format's other end (`slip_protocol.py`).

     END, command, data .., Fletcher-16 (low, high), END        END = C0h; C0h and DBh inside are escaped

     command   data                 answer
     1 set     lamp 0..2, level     1, lamp, level              levels 0..100; the lamp is on P1 if it is not 0
     2 get     lamp 0..2            2, lamp, level
     3 name    up to 12 characters  3, how many
     4 who     -                    4, name

   The interrupt takes escapes away and collects a frame; the main loop checks it, answers, and sleeps. What is wrong
   with a frame is not answered. `make` builds this twice: as it was when it was fuzzed, and with BOUNDS_CHECKED. */

#include <8052.h>

#define END     0xC0
#define ESC     0xDB
#define ESC_END 0xDC
#define ESC_ESC 0xDD

#define LAMPS    3
#define BRIGHT   100
#define NAME     12
#define LONGEST  (1 + NAME + 2)

enum { SET = 1, GET, TELL_NAME, WHO };

static volatile __idata unsigned char frame[LONGEST];
static volatile __idata unsigned char level[LAMPS];
static volatile unsigned char length;
static volatile __bit escaped;
static volatile __bit complete; /* the frame belongs to the main loop until it is answered */
static volatile __bit sending;

static __idata char name[NAME];
static unsigned char name_length;

/* A character of the frame, as it is behind escapes. One that does not fit makes the frame too long to be right. */
static void received(void) __interrupt(SI0_VECTOR)
{
    unsigned char c;

    if (TI) {
        TI = 0;
        sending = 0;
    }
    if (!RI)
        return;
    RI = 0;
    c = SBUF;
    if (complete)
        return;
    if (c == END) {
        complete = length != 0;
        escaped = 0;
    } else if (c == ESC) {
        escaped = 1;
    } else if (escaped) {
        escaped = 0;
        c = c == ESC_END ? END : ESC;
#ifdef BOUNDS_CHECKED
        if (length < LONGEST)
#endif
        frame[length++] = c;
    } else if (length < LONGEST) {
        frame[length++] = c;
    }
}

static unsigned char sum_low, sum_high;

static void sum(unsigned char c)
{
    unsigned int both = sum_low + c;

    sum_low = both >= 255 ? both - 255 : both;
    both = sum_high + sum_low;
    sum_high = both >= 255 ? both - 255 : both;
}

static void send_raw(unsigned char c)
{
    while (sending)
        ;
    sending = 1;
    SBUF = c;
}

static void send_escaped(unsigned char c)
{
    if (c == END || c == ESC) {
        send_raw(ESC);
        c = c == END ? ESC_END : ESC_ESC;
    }
    send_raw(c);
}

static void send(unsigned char c)
{
    sum(c);
    send_escaped(c);
}

static void begin_answer(unsigned char command)
{
    sum_low = sum_high = 0;
    send_raw(END);
    send(command);
}

static void end_answer(void)
{
    unsigned char high = sum_high;

    send_escaped(sum_low);
    send_escaped(high);
    send_raw(END);
}

/* Whether the last two bytes are the Fletcher-16 of those before. */
static unsigned char is_good(void)
{
    unsigned char at;

    if (length < 3)
        return 0;
    sum_low = sum_high = 0;
    for (at = 0; at < length - 2; at++)
        sum(frame[at]);
    return frame[length - 2] == sum_low && frame[length - 1] == sum_high;
}

static void answer_lamp(unsigned char command, unsigned char lamp)
{
    begin_answer(command);
    send(lamp);
    send(level[lamp]);
    end_answer();
}

static void set(unsigned char lamp, unsigned char bright)
{
    unsigned char mask = 1 << lamp;

    level[lamp] = bright;
    if (bright)
        P1 |= mask;
    else
        P1 &= ~mask;
}

static void act(unsigned char size)
{
    unsigned char at;

    if (frame[0] == SET && size == 3 && frame[1] < LAMPS && frame[2] <= BRIGHT) {
        set(frame[1], frame[2]);
        answer_lamp(SET, frame[1]);
    } else if (frame[0] == GET && size == 2 && frame[1] < LAMPS) {
        answer_lamp(GET, frame[1]);
    } else if (frame[0] == TELL_NAME && size <= 1 + NAME) {
        name_length = size - 1;
        for (at = 0; at < name_length; at++)
            name[at] = frame[1 + at];
        begin_answer(TELL_NAME);
        send(name_length);
        end_answer();
    } else if (frame[0] == WHO && size == 1) {
        begin_answer(WHO);
        for (at = 0; at < name_length; at++)
            send(name[at]);
        end_answer();
    }
}

void main(void)
{
    P1 = 0;
    TMOD = 0x20; /* timer 1: 8 bits, reloaded */
    TH1 = 0xFD;  /* 11.0592 MHz / 12 / 32 / 3, doubled: 19200 baud */
    TL1 = 0xFD;
    PCON = 0x80;
    TR1 = 1;
    SCON = 0x50; /* mode 1, receiver on */
    ES = 1;
    EA = 1;
    for (;;) {
        EA = 0;
        if (!complete) {
            EA = 1;
            PCON |= 0x01; /* IDL: EA takes effect one instruction later, so no interrupt comes in between */
            continue;
        }
        EA = 1;
        if (is_good())
            act(length - 2);
        length = 0;
        complete = 0;
    }
}
