"""Firmware with mistakes in it. A line with a mistake says so: `/* race stamp */` is the kind and the variable; all
other lines are correct idioms, of which nothing may be reported.
"""

import re

RACES = """\
#include <8052.h>
volatile unsigned int stamp, safe, guarded, out;
volatile unsigned long clock;
volatile unsigned char count, flag, steps, full;
volatile struct { unsigned char low : 3; unsigned char high : 3; } both;
volatile struct { unsigned char x; unsigned int far; } place;
volatile unsigned int pair[2];
volatile unsigned char buffer[4];
volatile unsigned int copy, taken;
volatile unsigned long longer;
unsigned char plain, left, waiting, reload;

void tick(void) __interrupt(1)
{
    TH0 = 0xFE;
    stamp++;
    safe++;
    guarded += 3;
    clock += 3;
    count++;
    steps++;
    flag = 1;
    both.low = 2;
    place.far = stamp;
    pair[1] = stamp;
    if (!full) {
        buffer[1] = flag;
        full = 1;
    }
    taken = out;
    plain++;
    left = 0;
    waiting++;
    reload = 9;
}

void main(void)
{
    TMOD = 0x21;
    TH0 = 0xFE;
    TR0 = 1;
    ET0 = 1;
    EA = 1;
    for (;;) {
        copy = stamp; /* race stamp */
        longer = clock; /* race clock */
        count += 5; /* race count */
        both.high = 3; /* race both.high */
        out = 0x1234; /* race out */
        copy = place.far; /* race place.far */
        copy = pair[1]; /* race pair */
        EA = 0;
        copy = safe;
        EA = 1;
        ET0 = 0;
        copy = guarded;
        guarded = 7;
        ET0 = 1;
        steps++; /* race steps */
        plain++;
        if (flag)
            flag = 0;
        if (left) /* race left */
            left--;
        if (waiting)
            waiting--;
        if (reload)
            reload--;
        if (full) {
            buffer[1] |= 2;
            full = 0;
        }
        place.x = flag;
        left = 3;
    }
}
"""

OVERLAYS = """\
#include <8052.h>
unsigned char out, ticks, other;
volatile unsigned int total;
unsigned int mix(unsigned int a, unsigned int b) { return a + b; }
unsigned char half(unsigned char a, unsigned char b)
{
    unsigned char i, sum = 0;
    for (i = 0; i < a; i++)
        sum += b;
    return sum;
}
unsigned char filled(unsigned char a)
{
    unsigned char box[3];
    box[a & 1] = a;
    box[2] = half(a, 2);
    return box[a & 1];
}
unsigned char alone(unsigned char a) { return a ^ 5; }
void tick(void) __interrupt(1)
{
    TH0 = 0xFE;
    total = mix(total, 3);
    ticks = total % 7;
    out = half(2, 3);
    other = filled(out);
}
void main(void)
{
    unsigned int x = 1;
    TMOD = 0x21;
    TH0 = 0xFE;
    TR0 = 1;
    ET0 = 1;
    EA = 1;
    for (;;) {
        x = mix(x, 5);
        x = x % 11;
        out = half(x, 7);
        out = filled(x);
        out = alone(x);
        EA = 0;
        x = mix(x, 6);
        EA = 1;
    }
}
"""
OVERLAID = {"mix", "half", "filled", "_moduint"}
"""Functions of OVERLAYS whose bytes its interrupt overwrites."""

TIMES = """\
#include <8052.h>
volatile unsigned int now, began;
volatile unsigned char low, high, wait, due;

unsigned int count(void)
{
    return TH0 << 8 | TL0; /* timer */
}

unsigned int right(void)
{
    unsigned char top, rest;
    do {
        top = TH0;
        rest = TL0;
    } while (top != TH0);
    return (unsigned int)top << 8 | rest;
}

void pause(void)
{
    for (wait = 0; wait < 20; wait++)
        ;
}

void main(void)
{
    TMOD = 0x11;
    TR0 = 1;
    TR1 = 1;
    TR2 = 1;
    for (;;) {
        now = count();
        pause();
        low = TL1; /* timer */
        high = TH1;
        pause();
        began = TH2 << 8 | TL2; /* timer */
        pause();
        if ((TH0 << 8 | TL0) - now > 500) /* timer */
            due = 1;
        pause();
        began = right();
        pause();
        TR1 = 0;
        low = TL1;
        high = TH1;
        TR1 = 1;
        TR2 = 0;
        began = TH2 << 8 | TL2;
        TR2 = 1;
        began = RCAP2H << 8 | RCAP2L;
        low = TL0;
        pause();
        TH0 = 0xF8;
        TL0 = 0x30;
    }
}
"""

_PLANTED = re.compile(r"/\* ([a-z]+)(?: ([\w.]+))? \*/")


def planted(text, file="program.c"):
    """The mistakes that a program says it has, as `kind file:line variable`."""
    marked = (
        (number, _PLANTED.search(line)) for number, line in enumerate(text.splitlines(), 1) if "/*" in line
    )
    return {f"{mark[1]} {file}:{number} {mark[2] or ''}".strip() for number, mark in marked if mark}


SILENT = {
    "what a routine keeps for its next call": """\
#include <8052.h>
unsigned char twice(unsigned char value)
{
    static unsigned char before;
    unsigned char sum = before + value;
    before = value;
    return sum;
}
void tick(void) __interrupt(1)
{
    static unsigned char phase, kept[4];
    static unsigned int turns;
    turns++;
    kept[turns & 3] = (kept[turns & 3] << 1) | P1_0;
    P0 = twice(phase);
    phase = (phase + 1) & 3;
}
void main(void)
{
    TMOD = 2;
    TH0 = 6;
    ET0 = 1;
    TR0 = 1;
    EA = 1;
    for (;;)
        ;
}
""",
    "variables that are set before their timer runs": """\
#include <8052.h>
unsigned int period = 4000;
void tick(void) __interrupt(1)
{
    TH0 = period >> 8;
    TL0 = period;
    period += 100;
}
void main(void)
{
    IE = 0x82;
    TMOD = 1;
    period = P1;
    period += 4000;
    TH0 = period >> 8;
    TL0 = period & 0xFF;
    TR0 = 1;
    for (;;)
        ;
}
""",
}
"""Programs without a mistake."""


AGAIN = """\
#include <8052.h>
volatile unsigned int now;
volatile unsigned long clock;
volatile __xdata unsigned int far;
unsigned int copy, before;
unsigned long longer;

void tick(void) __interrupt(1)
{
    TH0 = 0xFE;
    now++;
    clock++;
    far++;
}

unsigned int get(void)
{
    unsigned int first;
    do
        first = now;
    while (first != now);
    return first;
}

unsigned int twice(void)
{
    unsigned int first, second;
    do {
        first = now;
        second = now;
    } while (first != second);
    return first;
}

void main(void)
{
    TMOD = 0x21;
    TH0 = 0xFE;
    TR0 = 1;
    ET0 = 1;
    EA = 1;
    for (;;) {
        copy = get();
        copy = twice();
        do
            copy = now;
        while (copy != now);
        do
            longer = clock;
        while (longer != clock);
        do {
            copy = far;
        }
        while (copy != far);
        do
            copy = now; /* race now */
        while (copy == before);
        copy = now; /* race now */
        if (copy != now) /* race now */
            P1_0 = 1;
        do
            copy = now; /* race now */
        while ((unsigned char)copy != (unsigned char)now);
    }
}
"""
"""A variable is read until two values are equal; and what only looks like that."""
