cimport cython

cdef long long _ACTING, _TESTING, _TO_TI, _CHARACTER, _NEVER
cdef int _ANSWER_SIZE


cdef class SilenceRule:
    cdef readonly long long after_ticks, tolerance_ticks, received_tick
    cdef public long long last_tick

    cpdef long long end_tick(self) noexcept
    cpdef long long earliest_tick(self) noexcept
    cpdef long long latest_tick(self) noexcept
    cpdef void received(self, long long tick) noexcept
    cpdef long long deadline(self) noexcept
    cpdef bint is_over(self, long long tick) noexcept
    cpdef bint is_judged(self, long long tick) noexcept
    cpdef bint is_early(self, long long tick) noexcept


cdef class DrivingRule:
    cdef readonly long long within_ticks, deadline
    cdef public long long fresh_tick
    cdef readonly list waiting

    cpdef begin(self)
    cpdef bint may_move(self, long long tick) noexcept
    cpdef team(self, long long tick, int left, int right)
    cpdef told(self, int left, int right)
    cpdef missed(self, long long tick)


cdef class OriginRule:
    cdef readonly long long within_ticks
    cdef readonly object frames

    cpdef team(self, long long tick, int left, int right)
    @cython.locals(begun='long long', sent_left=int, sent_right=int, allowed=bint)
    cpdef bint allows(self, long long tick, int left, int right) except -1


cdef class AnswerRule:
    cdef readonly long long within_ticks, asked_tick
    cdef readonly int asked_seq, last_seq, before_seq, allowed

    cpdef void begin(self) noexcept
    cpdef void question(self, long long tick, int seq) noexcept
    cpdef bint character(self) noexcept
    cpdef bint in_turn(self, int seq) noexcept
    cpdef long long late(self, long long tick, int seq) noexcept
    cpdef long long missed(self, long long tick) noexcept
