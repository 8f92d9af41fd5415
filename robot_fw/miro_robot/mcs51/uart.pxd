cimport cython

from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.interrupts cimport Interrupts
from miro_robot.mcs51.line cimport Line

cdef long long _NEVER
cdef long long _STOPPED
cdef long long _STOPPED_PERIOD
cdef int _SERIAL
cdef int _SM0, _SM1, _SM2, _REN, _TB8, _RB8, _TI, _RI
cdef int _ROLLOVERS, _COUNTER_BITS
cdef int _VOTE_FIRST, _VOTE_LAST, _ACTION, _LAST_BIT, _LAST_ACTION

cdef long long _flag_tick(long long tick) noexcept

@cython.final
cdef class Uart:
    cdef Bus bus
    cdef Interrupts interrupts
    cdef readonly Line rxd
    cdef readonly Line txd
    cdef readonly int latch
    cdef readonly int scon
    cdef public int received
    cdef readonly long long tx_next
    cdef readonly long long tx_period
    cdef int tx_phase
    cdef int tx_bits
    cdef int tx_left
    cdef int tx_value
    cdef long long tx_delay
    cdef public int tx_level
    cdef long long tx_edge
    cdef int tx_coming
    cdef readonly long long rx_next
    cdef readonly long long rx_period
    cdef int rx_count
    cdef int rx_last
    cdef int rx_votes
    cdef int rx_bits
    cdef long long rx_done
    cdef int rx_frame

    cpdef int clear(self, long long cycle) except -1
    cdef int abort(self, long long tick) except -1
    cdef inline int mode(self) noexcept
    cdef inline int nine_bits(self) noexcept
    cpdef void set_clock(self, long long rx_next, long long rx_period, long long tx_next, long long tx_period) noexcept
    cpdef int sync(self, long long tick) except -1
    cpdef int check_times(self, long long tick) except -1
    cpdef int pulse(self, int rx, int tx, long long tick) except -1
    cpdef int level(self, long long tick) noexcept
    cpdef int write_scon(self, int value, long long cycle) except -1
    cdef void ask_or_withdraw(self, long long cycle) noexcept
    @cython.locals(ninth=int)
    cpdef void write_sbuf(self, int value) noexcept
    cpdef int write_latch(self, int latch, long long tick) except -1
    cpdef void raise_flag(self, int flag, long long tick) noexcept
    @cython.locals(rollover='long long', passed='long long')
    cdef int _transmit(self, long long tick) except -1
    cdef int _edge(self) except -1
    @cython.locals(rollover='long long', last='long long', delay='long long')
    cpdef long long ti_tick(self) noexcept
    cdef void _receive(self, long long tick) noexcept
    @cython.locals(now='long long', enabled=int, level=int, change='long long')
    cdef void _search(self, long long tick) noexcept
    @cython.locals(period='long long', level=int, state=int, idle='long long', now='long long')
    cdef void _bit(self, long long tick) noexcept
    @cython.locals(period='long long', idle=int, first='long long', number=int, most=int, found=int, more=int, level=int)
    cdef bint _unanimous(self, long long tick) noexcept
    @cython.locals(number=int, bit=int)
    cdef inline void _act(self, long long now) noexcept
    @cython.locals(tick='long long', last=int)
    cdef void _deliver(self) noexcept
    @cython.locals(start='long long')
    cpdef long long ri_tick(self) noexcept
    @cython.locals(tick='long long', settled='long long', change='long long')
    cdef inline long long _start_tick(self) noexcept
    cdef long long turn_tick(self) noexcept
