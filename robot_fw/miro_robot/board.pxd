cimport cython
from miro_robot.lm629.bus_timing cimport BusTiming
from miro_robot.lm629.chip cimport Lm629
from miro_robot.plant cimport Plant
from miro_robot.probe cimport Probe
from miro_robot.processor_board cimport ProcessorBoard

cdef int _ADDRESS, _RELEASE, _DATA, _STROBE, _SAMPLE, _STROBE_ENDS, _DATA_ENDS, _PAGE_ENDS
cdef int _CS, _BOTH_STROBES, _CHIP_PINS, _ALL_PINS, _BOTH_RST, _WR, _RD, _BEHIND_TICKS
cdef int RESET_PULSE, PORTS, FAULT, REPLAN
cdef long long CYCLE_TICKS, RESET_PULSE_TICKS, NEVER_TICK


cdef class Board(ProcessorBoard):
    cdef public object wiring
    cdef public Probe probe
    cdef readonly Lm629 left, right
    cdef readonly Plant plant
    cdef public long long fault_count
    cdef long long horizon
    cdef int strobed, reset_pins
    cdef long long busy_writes
    cdef int contention
    cdef readonly int held
    cdef int forced
    cdef readonly int powered
    cdef int bus_levels
    cdef unsigned char bank[13]
    cdef unsigned char watched[13]
    cdef unsigned char external[4]
    cdef unsigned char bridge_enable[2]
    cdef unsigned char bridge_sign[2]
    cdef unsigned char hi_seen[2]
    cdef int stuck
    cdef unsigned char low_pins[4]
    cdef unsigned char high_pins[4]
    cdef readonly BusTiming left_timing, right_timing
    cdef int on_movx_bus, data_bank
    cdef unsigned short pin_levels[3328]
    cdef int pin_banks
    cdef int pin_bank[10]
    cdef int latches
    cdef int latch_address[8]
    cdef int latch_mask[8]
    cdef int buffers
    cdef int buffer_address[8]
    cdef int buffer_mask[8]
    cdef list hi_pins

    @cython.locals(index=cython.int, bank=cython.int, bit=cython.int, inverted=cython.int)
    cdef _resolve_outputs(self, wiring)
    @cython.locals(port=int)
    cdef int _note_stuck(self) except -1
    cdef int _rest(self, BusTiming timing, Lm629 chip) except -1
    cpdef int go_on(self, long long until_tick) except -1
    @cython.final
    cdef inline long long _next_interrupt(self, Lm629 chip) noexcept
    cpdef int sync(self, long long tick) except -1
    @cython.final
    cdef int _let_hi_fall(self) except -1
    @cython.final
    cdef inline int _set_pins(self, int port, int levels, long long tick) except -1
    @cython.final
    cdef inline bint _only_levels(self, long long tick) except -1
    @cython.locals(heard=bint)
    cpdef int movx_read(self, int address, long long tick) except -1
    @cython.locals(changed=bint)
    cpdef movx_write(self, int address, int value, long long tick)
    cdef int _put_address(self, int address, long long start) except -1
    @cython.final
    cdef inline int _drive_bridge(self, long long tick) except -1
    @cython.final
    cdef int _set_bridge(self, long long tick, int side, Lm629 chip) except -1
    @cython.final
    @cython.locals(port=int, mask=int, inverted=int, side=int, high=bint)
    cdef int _drive_interrupts(self, long long tick) except -1
    @cython.final
    cdef inline int _pins(self) noexcept
    @cython.final
    cdef inline int _strobes(self, int pins) noexcept
    @cython.final
    cdef inline int _drive_chips(self, long long tick) except -1
    @cython.final
    cdef inline int _watch_bus(self, int both_drive, long long tick) except -1
    @cython.final
    cdef inline int _note_timing(self, int left, int right, long long tick) except -1
    @cython.final
    cdef int _reset_chips(self, int left, int right, long long tick) except -1
    cdef int _timing_fault(self, int limit, long long ticks, long long tick) except -1
    cdef int _note(self, int kind, int pc, long long tick, detail) except -1
