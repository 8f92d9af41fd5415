cimport cython
from miro_robot.mcs51.uart cimport Uart
from miro_robot.processor_board cimport ProcessorBoard

from miro_robot.mcs51.chip_registers cimport ChipRegisters

cdef long long CYCLE_TICKS, NEVER_TICK, STOPPED_TICK, _CHECK_CYCLES
cdef int _FLOATING, _MOVX_WITHOUT_STROBE
cdef int ENDED, FAULT, REACHED, ASLEEP, BREAKPOINT, REPLAN, STOPPED, _EA, _SOURCES, _IE, _PAGE, _BYTES, _DATA_BITS, _ROLLOVERS, _OLD, _FRESH


cdef class EmptyBoard(ProcessorBoard):
    cdef readonly object spec, image
    cdef readonly tuple loops
    cdef public tuple stop_at, ends
    cdef public bint stop_at_end
    cdef public object sent, listening
    cdef public long long input_tick
    cdef int forced, again
    cdef readonly bint shared
    cdef public long long fault_count, next_check
    cdef readonly int held, powered
    cdef public int dead, ended
    cdef int xram_end
    cdef bytearray ram, written
    cdef unsigned char[::1] memory, wrote
    cdef unsigned char touched[256]
    cdef readonly ChipRegisters registers
    cdef unsigned int lacking[256]
    cdef long long lacking_cycle

    @cython.locals(registers=ChipRegisters, end_cycle='long long')
    cdef int _run(self, tuple addresses, long long until_tick) except -1
    cdef int _run_on(self, tuple marks, long long until_cycle) except -1
    cdef bint _may_wake(self) except -1
    cdef _note_fault(self, int kind, int pc, long long tick, detail)
    cdef _sleep_on(self, long long until_cycle)
    cdef _step(self)
    cdef _pass_mark(self, tuple addresses)
    cdef bint _say_ended(self) except -1
    cdef long long _silent_cycle(self) except -1
    cdef bint _interruptible(self) except -1
    cdef _note_lacking(self, int address)
    cdef _begin_again(self)
    @cython.locals(registers=ChipRegisters)
    cdef int _registers_due(self) except -1
    cdef int _watched(self) except -1
    cpdef hold_reset(self, int level)
    @cython.locals(uart=Uart)
    cdef tuple _bits(self)
    cpdef bytes xram(self)
    cpdef begin_period(self)
    cdef _store(self, int address, int value)
    cdef bytes _content(self, int least)
    cdef _put_code(self)
