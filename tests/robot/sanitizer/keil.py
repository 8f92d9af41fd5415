"""A program with a race, and the map that Keil's linker would write of it."""

CODE = """
    LJMP start
    ORG 0Bh
    PUSH ACC
    INC 9
    MOV A,9
    JNZ same
    INC 8
same:
    INC 0Ch
    MOV 20h,R0
    MOV R0,#0Dh
    INC @R0
    INC R0
    INC @R0
    MOV R0,20h
    POP ACC
    RETI
    ORG 40h
main:
    MOV 0Ah,8
    MOV 0Bh,9
    MOV R0,#0Dh
    MOV A,@R0
    INC R0
    ADD A,@R0
    CLR EA
    MOV 0Ah,8
    MOV 0Bh,9
    SETB EA
    MOV A,0Ch
    ADD A,#5
    MOV 0Ch,A
    LJMP main
    ORG 80h
start:
    MOV SP,#20h
    MOV TMOD,#2
    MOV IE,#82h
    SETB TR0
    LJMP main
"""
MAP = """\
BL51 BANKED LINKER/LOCATER V6.22                                          01/02/2024  10:00:00  PAGE 1

INPUT MODULES INCLUDED:
  .\\Objects\\clock.obj (CLOCK)

LINK MAP OF MODULE:  .\\Objects\\clock (CLOCK)

            TYPE    BASE      LENGTH    RELOCATION   SEGMENT NAME
            -----------------------------------------------------
            REG     0000H     0008H     ABSOLUTE     "REG BANK 0"
            DATA    0008H     0008H     UNIT         ?DT?CLOCK
            IDATA   0021H     0001H     UNIT         ?STACK
            CODE    0000H     0003H     ABSOLUTE
            CODE    000BH     001AH     UNIT         ?PR?TICK?CLOCK
            CODE    0040H     0025H     UNIT         ?PR?MAIN?CLOCK
            CODE    0080H     000EH     UNIT         ?C_C51STARTUP

SYMBOL TABLE OF MODULE:  .\\Objects\\clock (CLOCK)

  VALUE           TYPE          NAME
  ----------------------------------
  -------         MODULE        CLOCK
  D:0008H         PUBLIC        ms
  D:000AH         SYMBOL        copy
  D:000CH         PUBLIC        count
  D:000DH         PUBLIC        buffer
  C:000BH         PUBLIC        tick
  C:0040H         PUBLIC        main
  -------         PROC          TICK
  C:000BH         LINE#         5
  -------         ENDPROC       TICK
  -------         PROC          MAIN
  C:0040H         LINE#         12
  C:0046H         LINE#         13
  C:004BH         LINE#         14
  C:0055H         LINE#         15
  C:005AH         LINE#         16
  -------         ENDPROC       MAIN
  -------         ENDMOD        CLOCK
"""
