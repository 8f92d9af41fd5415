cimport cython
from miro_robot.lm629.chip cimport Lm629
from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.cpu cimport Cpu
from miro_robot.plant cimport Plant
from miro_robot.probe cimport Probe


cdef class Board(Bus):
    cdef public object wiring
    cdef public object faults
    cdef public Probe probe
    cdef readonly Cpu cpu
    cdef readonly Lm629 left
    cdef readonly Lm629 right
    cdef readonly Plant plant
    cdef public bint stop_on_fault
    cdef public long long fault_count
    cdef long long busy_writes
    cdef int contention
    cdef int bus_levels
    cdef unsigned char bank[13]
    cdef unsigned char watched[13]
    cdef unsigned char external[4]
    cdef unsigned char bridge_enable[2]
    cdef unsigned char bridge_sign[2]
    cdef unsigned char hi_seen[2]
    cdef int data_bank
    cdef int pin_bank[10]
    cdef int pin_bit[10]
    cdef int pin_inverted[10]
    cdef int latches
    cdef int latch_address[8]
    cdef int latch_mask[8]
    cdef int buffers
    cdef int buffer_address[8]
    cdef int buffer_mask[8]
    cdef int hi_count
    cdef int hi_port[8]
    cdef int hi_bit[8]
    cdef int hi_inverted[8]
    cdef int hi_side[8]

    @cython.locals(stopped=cython.int, horizon=cython.longlong)
    cpdef int run(self, long long until_tick) except -1
    cdef long long _next_interrupt(self, Lm629 chip)
    @cython.locals(now=cython.longlong)
    cpdef int sync(self, long long tick) except -1
    cpdef port_written(self, int port, int latch, long long tick)
    cpdef int movx_read(self, int address, long long tick) except -1
    cpdef movx_write(self, int address, int value, long long tick)
    cpdef fault(self, int kind, int pc, long long tick)
    cdef void _drive_bridge(self, long long tick)
    @cython.locals(index=cython.int, hi=cython.int, level=cython.int, port=cython.int, mask=cython.int, levels=cython.int)
    cdef void _drive_interrupts(self, long long tick)
    cdef int _level(self, int index)
    @cython.locals(data=cython.int, from_left=cython.int, from_right=cython.int, levels=cython.int)
    cdef int _drive_chips(self, long long tick) except -1
    @cython.locals(busy_writes=cython.longlong)
    cdef int _watch_bus(self, bint both_drive, long long tick) except -1
