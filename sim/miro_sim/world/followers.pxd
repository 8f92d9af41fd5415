cimport cython

cdef long long NEVER_TICK
cdef double _ENDLESS


cdef class Follower:
    cdef readonly object source
    cdef readonly long long clock
    cdef public long long count, last_tick
    cdef public object last

    cpdef list feed(self, list changes, long long until_tick)


cdef class PinFollower(Follower):
    cdef long long net
    cdef int flip, outside
    cdef double hz, least, most


cdef class EdgeFollower(PinFollower):
    cdef int wanted

    @cython.locals(tick='long long', net='long long', level=int, count='long long', last_tick='long long', last=int)
    cpdef list feed(self, list changes, long long until_tick)


cdef class LevelFollower(PinFollower):
    cdef int wanted
    cdef object steady_ms
    cdef long long steady_ticks
    cdef public long long longest, since
    cdef public int level, done

    @cython.locals(tick='long long', net='long long', level=int, wanted=int)
    cpdef list feed(self, list changes, long long until_tick)
    cdef _had_until(self, long long tick, list matches)


cdef class PulseFollower(PinFollower):
    cdef int wanted
    cdef public long long began

    @cython.locals(
        tick='long long', net='long long', level=int, began='long long', count='long long', end_tick='long long', width_us=double
    )
    cpdef list feed(self, list changes, long long until_tick)


cdef class PeriodFollower(PinFollower):
    cdef int high
    cdef long long patience
    cdef public long long rise, late_tick

    @cython.locals(
        tick='long long', net='long long', level=int, rise='long long', late_tick='long long', count='long long',
        end_tick='long long', hz=double
    )
    cpdef list feed(self, list changes, long long until_tick)


cdef class DutyFollower(PinFollower):
    cdef int high
    cdef public long long rise, fall

    @cython.locals(
        tick='long long', net='long long', level=int, rise='long long', fall='long long', count='long long',
        end_tick='long long', share=double
    )
    cpdef list feed(self, list changes, long long until_tick)
