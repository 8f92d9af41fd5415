cimport cython
from miro_robot.lm629.bus_timing cimport BusTiming
from miro_robot.lm629.chip cimport Lm629
from miro_robot.parts.part cimport Part

cdef long long NEVER_TICK, _RESET_TICKS
cdef int LOW, RELEASED, _PS, _RD, _WR, _CS, _RST, _HI, _MAG, _SIGN, _A, _B, _IN
cdef int _TIMING, _BUSY, _CONTENTION, _KEPT, RESET_PULSE
cdef unsigned int _BUS, _PHASES, _INDEX, _STROBES, _READS


cdef class Lm629Part(Part):
    cdef readonly Lm629 chip
    cdef readonly BusTiming timing
    cdef list others_on_bus
    cdef int pulled, pulses_reach
    cdef public int contention, powered

    @cython.locals(chip=Lm629, levels='unsigned int', data=int, cs=int, rd=int, wr=int, ps=int, broken=int, rst=int, low_ticks='long long', lost='long long')
    cdef int _see_bus(self, long long tick) except -1
    @cython.locals(other=Lm629Part)
    cdef int _show_others(self, long long tick) except -1
    @cython.locals(data=int, other=Lm629Part, theirs=int, both=int)
    cdef int _data(self) except -1
    @cython.locals(lows=int, pin=int)
    cdef int _lows(self) noexcept
    @cython.locals(reading=int, other=Lm629Part, contention=int)
    cdef int _watch_others(self) except -1
    cdef list _others_at(self, int pin)
    cdef int _see_encoder(self, long long tick, unsigned int pins) except -1
    @cython.locals(chip=Lm629)
    cdef int _answer(self) except -1
    @cython.locals(other=Lm629Part, pin=int)
    cdef int _pull(self, int lows) except -1
