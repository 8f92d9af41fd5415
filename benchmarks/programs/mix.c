/* A mix like Dhrystone's: records and pointers to them, strings, arrays, enumerations, small functions. */

#include "bench.h"
#include <string.h>

enum kind { FIRST, SECOND, THIRD, FOURTH, FIFTH };

struct record {
    struct record __xdata *next;
    enum kind kind;
    int16_t number;
    char text[24];
};

static __xdata struct record one, two;
static __xdata uint8_t row[50], grid[10][10];
static const __code char some[] = "DHRYSTONE-LIKE PROGRAM,";
static uint8_t flag;
static char letter;
static int16_t global;

static enum kind choose(char a, char b) { return a == b ? FIRST : SECOND; }

static int16_t add(int16_t a, int16_t b) { return a + 2 + b; }

static uint8_t ordered(const __xdata char *a, const __xdata char *b)
{
    uint8_t i = 2;

    while (i <= 2)
        if (choose(a[i], b[i + 1]) == FIRST)
            letter = 'A', i++;
        else
            i += 3;
    return strcmp(a, b) > 0;
}

static enum kind successor(enum kind kind)
{
    switch (kind) {
    case FIRST: return FIRST;
    case SECOND: return global > 100 ? FIRST : FOURTH;
    case THIRD: return SECOND;
    case FOURTH: return THIRD;
    default: return FIFTH;
    }
}

static void arrays(uint8_t at, int16_t value)
{
    uint8_t i;

    row[at + 5] = value;
    row[at + 6] = row[at + 5];
    row[at + 35] = at + 5;
    for (i = at; i <= at + 1; i++)
        grid[at][i] = at;
    grid[at][at - 1]++;
    global = 5;
}

static void records(struct record __xdata *record)
{
    struct record __xdata *next = record->next;

    *next = *record;
    record->number = 5;
    next->number = record->number;
    next->kind = successor(record->kind);
    next->number = add(next->number, 10);
    next->next = record->next;
}

void main(void)
{
    uint16_t round;
    int16_t a, b, c = 0;

    start();
    one.next = &two;
    one.kind = THIRD;
    memcpy(one.text, some, sizeof one.text);
    for (round = 0; round < 4000; round++) {
        a = 2;
        b = 3;
        flag = !ordered(one.text, two.text);
        while (a < b) {
            c = 5 * a - b;
            c = add(a, c);
            a++;
        }
        arrays(a & 7, c);
        records(&one);
        for (letter = 'A'; letter <= 'C'; letter++)
            if (choose(letter, 'C') == FIRST)
                one.kind = successor(two.kind);
        b = b * a;
        a = b / 3;
        b = 7 * (b - c) - a;
        one.text[round % 20 + 2]++;
        checksum = checksum * 31 + (uint16_t)b + row[a & 31] + flag + two.kind + (uint8_t)two.text[7];
    }
    finish();
}
