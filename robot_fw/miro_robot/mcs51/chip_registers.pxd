cimport cython
from miro_robot.mcs51.chip cimport Chip

cdef long long NEVER_TICK
cdef int NO_PAUSE, FLASH_PAUSE, RESET_PAUSE, _RESET_CYCLES
cdef int _DP1L, _DP1H, _P4, _WDT_CONTR, _AUXR, _AUXR1, _WDTRST, _IPH
cdef int _ISP_DATA, _ISP_ADDRH, _ISP_ADDRL, _ISP_CMD, _ISP_TRIG, _ISP_CONTR
cdef int _DPS, _GF2, _WDIDLE, _AT_AUXR, _EXTRAM, _STC_AUXR, _AT_PERIOD
cdef int _EN_WDT, _CLR_WDT, _IDLE_WDT, _WDT_FLAG, _PRESCALER, _STC_COUNTS
cdef int _ISPEN, _SWRST, _WAIT, _READ, _PROGRAM, _ERASE, _FLASH_AT, _FLASH_BYTES, _SECTOR_BYTES
cdef int _WAITS[12]

cdef class ChipRegisters:
    cdef Chip cpu
    cdef readonly int auxr, auxr1, other_dptr, key, watching, pause
    cdef readonly long long fed, flash_cycles, pause_end, due_cycle
    cdef readonly long long bites, first_bite
    cdef long long last_bite

    cpdef clear(self)
    cpdef begin(self)
    cpdef int read(self, int address) except -2
    cpdef int write(self, int address, int value) except -1
    cdef int auxr1_bits(self) except -1
    cdef int counts_idle(self) except -1
    cdef long long period(self) except -1
    cdef long long count(self) except? -1
    cdef int feed(self) except -1
    cdef int plan(self) except -1
    cpdef int watches(self) except -1
    cpdef int due(self) except -1
    @cython.locals(cycles='long long')
    cdef note_bite(self)
    cdef int end_pause(self) except -1
    cpdef hold(self)


cdef class At89s52Registers(ChipRegisters):
    @cython.locals(pointer=int)
    cdef int write_dp1(self, int address, int value) except -1


cdef class Stc89c52Registers(ChipRegisters):
    cdef readonly int wdt_contr, isp_data, isp_address, isp_cmd, isp_contr, p4, iph
    cdef int xram_bytes
    cdef unsigned char flash[5120]

    cdef int write_watchdog(self, int value) except -1
    cdef int write_isp(self, int address, int value) except -1
    cdef command(self, int at)
