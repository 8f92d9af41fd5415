cimport cython

from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.interrupts cimport Interrupts
from miro_robot.mcs51.line cimport Line

cdef long long NEVER_TICK, _STOPPED, _STOPPED_PERIOD
cdef int _SERIAL, _SM0, _SM1, _SM2, _REN, _TB8, _RB8, _TI, _RI
cdef int _ROLLOVERS, _COUNTER_BITS, _VOTE_FIRST, _VOTE_LAST, _ACTION, _LAST_BIT, _LAST_ACTION

cdef long long _flag_tick(long long tick) noexcept

@cython.final
cdef class Uart:
    cdef Bus bus
    cdef Interrupts interrupts
    cdef readonly Line rxd, txd
    cdef readonly int latch, scon
    cdef public int received
    cdef readonly long long tx_next, tx_period
    cdef int tx_phase, tx_bits, tx_value
    cdef readonly int tx_left
    cdef long long tx_delay
    cdef public int tx_level
    cdef readonly long long tx_edge
    cdef int tx_coming
    cdef readonly long long rx_next, rx_period
    cdef int rx_count, rx_last, rx_votes, rx_bits
    cdef long long rx_done
    cdef int rx_frame
    cdef readonly int overruns

    cpdef int clear(self, long long cycle) except -1
    cdef int abort(self, long long tick) except -1
    cdef inline int mode(self) noexcept
    cpdef void set_clock(self, long long rx_next, long long rx_period, long long tx_next, long long tx_period) noexcept
    cpdef int sync(self, long long tick) except -1
    cpdef int check_times(self, long long tick) except -1
    cpdef int pulse(self, int rx, int tx, long long tick) except -1
    cpdef int level(self, long long tick) noexcept
    cpdef int write_scon(self, int value, long long cycle) except -1
    cpdef void write_sbuf(self, int value) noexcept
    cpdef int write_latch(self, int latch, long long tick) except -1
    cpdef void raise_flag(self, int flag, long long tick) noexcept
    cdef int _transmit(self, long long tick) except -1
    cdef int _edge(self) except -1
    cpdef long long ti_tick(self) noexcept
    @cython.locals(level=int, edge='long long', number=int)
    cpdef int tx_at(self, long long tick) noexcept
    @cython.locals(level=int, edge='long long', number=int)
    cpdef long long tx_after(self, long long tick) noexcept
    cdef inline long long _first_bit(self) noexcept
    cdef void _receive(self, long long tick) noexcept
    cdef void _search(self, long long tick) noexcept
    cdef void _bit(self, long long tick) noexcept
    cdef bint _unanimous(self, long long tick) noexcept
    cdef inline void _act(self, long long now) noexcept
    cdef void _deliver(self) noexcept
    cpdef long long ri_tick(self) noexcept
    cdef inline long long _start_tick(self) noexcept
    cdef long long turn_tick(self) noexcept
