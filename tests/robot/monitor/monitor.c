/* A small monitor, as people run on 8051 boards: it measures the bit rate of a space, then takes commands.

   What belongs here: what such programs do that needs a terminal's patience. It polls RXD before the receiver is on,
   echoes, and answers line by line. Tests drive it through `mirotwin fw run`.

       d HEX        shows eight bytes of external RAM
       m HEX HEX    stores a byte there
       = EXPRESSION decimal numbers with + - * / and parentheses, 16 bits signed
       q            powers down

   A space is six low bits, start bit first, and Timer 2 counts machine cycles, so the count is 6 * 32 / 12 = 16 times
   the reload value that gives the same rate (AT89C52 data sheet, Timer 2 as a baud rate generator: fosc / 32 / reload).
*/
#include <8052.h>

#define LINE 24

static char line[LINE];
static unsigned char at;

static void put(char c)
{
    SBUF = c;
    while (!TI)
        ;
    TI = 0;
}

static void print(__code const char *text)
{
    while (*text)
        put(*text++);
}

static char get(void)
{
    char c;
    while (!RI)
        ;
    c = SBUF;
    RI = 0;
    return c;
}

static void match_rate(void)
{
    unsigned int reload;
    T2CON = 0;
    TH2 = TL2 = 0;
    while (RXD)
        ;
    TR2 = 1;
    while (!RXD)
        ;
    TR2 = 0;
    reload = (((unsigned int)TH2 << 8 | TL2) + 8) >> 4;
    RCAP2H = TH2 = (65536UL - reload) >> 8;
    RCAP2L = TL2 = (unsigned char)(0 - reload);
    while (RXD) /* bit 5 */
        ;
    while (!RXD) /* bits 6 and 7; the stop bit begins */
        ;
    T2CON = 0x34;
    SCON = 0x50;
}

static void read_line(void)
{
    char c;
    unsigned char length = 0;
    for (;;) {
        c = get();
        if (c == '\r')
            break;
        if (length < LINE - 1) {
            put(c);
            line[length++] = c;
        }
    }
    line[length] = 0;
    print("\r\n");
}

static void skip(void)
{
    while (line[at] == ' ')
        at++;
}

static void put_hex(unsigned char value)
{
    static __code const char digits[] = "0123456789ABCDEF";
    put(digits[value >> 4]);
    put(digits[value & 15]);
}

static unsigned int get_hex(void)
{
    unsigned int value = 0;
    skip();
    for (;;) {
        char c = line[at];
        if (c >= '0' && c <= '9')
            value = value << 4 | (c - '0');
        else if (c >= 'A' && c <= 'F')
            value = value << 4 | (c - 'A' + 10);
        else
            return value;
        at++;
    }
}

static void put_decimal(int value)
{
    static unsigned char digits[5];
    unsigned char count = 0;
    unsigned int left = value;
    if (value < 0) {
        put('-');
        left = -left;
    }
    do {
        digits[count++] = left % 10;
        left /= 10;
    } while (left);
    while (count)
        put('0' + digits[--count]);
}

static int sum(void) __reentrant;

static int factor(void) __reentrant
{
    int value = 0;
    skip();
    if (line[at] == '-') {
        at++;
        return -factor();
    }
    if (line[at] == '(') {
        at++;
        value = sum();
        at++;
        return value;
    }
    while (line[at] >= '0' && line[at] <= '9')
        value = 10 * value + (line[at++] - '0');
    skip();
    return value;
}

static int product(void) __reentrant
{
    int value = factor();
    for (;;) {
        if (line[at] == '*') {
            at++;
            value *= factor();
        } else if (line[at] == '/') {
            at++;
            value /= factor();
        } else
            return value;
    }
}

static int sum(void) __reentrant
{
    int value = product();
    for (;;) {
        if (line[at] == '+') {
            at++;
            value += product();
        } else if (line[at] == '-') {
            at++;
            value -= product();
        } else
            return value;
    }
}

static void command(void)
{
    __xdata unsigned char *place;
    unsigned char count;
    at = 1;
    switch (line[0]) {
    case 'd':
        place = (__xdata unsigned char *)get_hex();
        for (count = 0; count < 8; count++) {
            put_hex(*place++);
            put(' ');
        }
        break;
    case 'm':
        place = (__xdata unsigned char *)get_hex();
        *place = get_hex();
        break;
    case '=':
        put_decimal(sum());
        break;
    case 'q':
        print("bye\r\n");
        PCON = 2;
        break;
    case 0:
        return;
    default:
        put('?');
    }
    print("\r\n");
}

void main(void)
{
    match_rate();
    print("\r\nMonitor ready\r\n");
    for (;;) {
        print("> ");
        read_line();
        command();
    }
}
