"""Small firmwares for a bare processor, in assembler: they need no compiler. `image` makes an image of them."""

from tests.robot.mcs51.asm import image_of

image = image_of
SERIAL = """
MOV TMOD,#20h
MOV TH1,#0FDh
MOV TL1,#0FDh
SETB TR1
MOV SCON,#50h
"""

POLLS = f"""{SERIAL}
loop:
JNB RI,$
CLR RI
MOV A,SBUF
MOV SBUF,A
INC 30h
CJNE A,#21h,loop
LJMP 4000h
"""
"""Echoes; at `!` it runs into nothing. 30h counts. It never sleeps."""

SLEEPS = f"""
LJMP start
ORG 23h
JBC RI,got
CLR TI
RETI
got:
MOV A,SBUF
MOV DPTR,#1234h
MOVX @DPTR,A
CJNE A,#3Fh,other
stuck:
SJMP stuck
other:
CJNE A,#21h,answer
LJMP 4000h
answer:
MOV SBUF,A
RETI
start:
{SERIAL}
MOV IE,#90h
sleep:
ORL PCON,#01h
SJMP sleep
"""
"""Echoes from its interrupt and sleeps; at `!` it runs into nothing, at `?` it is stuck. XRAM 1234h: the last one."""

DEAF = "loop:\nSJMP loop"
FAULTY = "LJMP 4000h"
