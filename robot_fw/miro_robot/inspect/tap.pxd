cimport cython

from miro_robot.board cimport Board
from miro_robot.inspect.watcher cimport Watcher
from miro_robot.mcs51.cpu cimport Cpu
from miro_robot.mcs51.line cimport Line
from miro_robot.probe cimport Probe

cdef long long NEVER_TICK
cdef int _TICKS
cdef int _RXD, _TXD, _SHIFT, _LATCH, _OUTSIDE, _ASLEEP, _IN_SERVICE, _ROUTINE, _DATA, _SIDE
cdef int _CS, _BUSY, _HI, _PWM, _SIGN, _MAGNITUDE, _A, _B, _PER_SIDE
cdef int _CHIP_PINS, _PLACES

cdef class BoardTap(Probe):
    cdef Board board
    cdef list events
    cdef int levels[45]
    cdef long long busy_end[2]
    cdef readonly long long passed_tick
    cdef list left_edges, right_edges

    cpdef attach(self, long long tick)
    cpdef detach(self)
    cpdef long long known(self) except -1
    cdef int _look_at_pins(self, long long tick) except -1
    cdef int _look(self, long long tick) except -1
    cdef int _look_at_chip(self, long long tick, int side) except -1
    cdef int _start_edges(self, int place, int state) except -1
    @cython.locals(tick='long long', a=int, b=int)
    cdef int _take_edges(self, int place, list edges) except -1
    cdef inline int _see(self, long long tick, int place, int level) except -1

cdef class CpuTap(Watcher):
    cdef object told
    cdef readonly list events
    cdef BoardTap board_tap
    cdef object net_tap
    cdef readonly long long begin_tick
    cdef readonly list start
    cdef int levels[20]
    cdef long long line_ticks[3]
    cdef long long cycles
    cdef int routine[2]

    cpdef long long known(self) except -1
    cpdef detach(self)
    cpdef take(self)
    cdef int _look(self, Cpu cpu) except -1
    cdef int _leave(self, long long tick, int high, int level) except -1
    cdef int _take_outputs(self, Cpu cpu) except -1
    cdef int _take_line(self, int place, Line line, long long until_tick) except -1
    cdef inline int _see(self, long long tick, int place, int level) except -1
