cimport cython

from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.interrupts cimport ExternalInterrupts, Interrupts
from miro_robot.mcs51.ports cimport Ports
from miro_robot.mcs51.shift cimport Shift
from miro_robot.mcs51.timer2 cimport Timer2
from miro_robot.mcs51.timers cimport Timers
from miro_robot.mcs51.uart cimport Uart

cdef long long NEVER_TICK
cdef long long _NO_PERIOD, STOPPED_TICK
cdef int _P0, _TCON, _TMOD, _TL0, _TL1, _TH0, _TH1, _SCON, _SBUF, _IE, _IP
cdef int _T2CON, _T2MOD, _RCAP2L, _RCAP2H, _TL2, _TH2, _RCLK, _TCLK
cdef int _S5P2, _SERIAL, _TIMER2, _BOTH_TIMERS, _REN, _SETTINGS, _RI_TI

@cython.final
cdef class Peripherals:
    cdef Bus bus
    cdef readonly Interrupts interrupts
    cdef readonly ExternalInterrupts external
    cdef readonly Timers timers
    cdef readonly Timer2 timer2
    cdef readonly Uart uart
    cdef readonly Shift shift
    cdef readonly Ports ports
    cdef readonly int smod
    cdef int p1, p3, short1, short3
    cdef public int frozen
    cdef int pulsed
    cdef public long long written
    cdef public int has_timer2, observed, listened
    cdef readonly long long now
    cdef long long timer_wait, serial_wait, quiet
    cdef int timer1_free
    cdef readonly long long p3_reads

    cpdef int clear(self, long long cycle) except -1
    cpdef int check_times(self, long long cycle) except -1
    cpdef int freeze(self, long long cycle) except -1
    cpdef int sync(self, long long cycle) except -1
    cdef int _catch_up(self, long long cycle) except -1
    cdef inline void _note_quiet(self) noexcept
    cpdef void look_again(self) noexcept
    cpdef int settle(self, long long cycle) except -1
    cdef int _settle_serial(self) except -1
    cdef int _sync_pulsed(self, long long cycle) except -1
    @cython.locals(halved=int)
    cdef int _pulse(self, int timer1, int timer2, long long cycle) except -1
    cpdef long long next_event(self, long long now) except *  # Cython 3.2 writes -1 wrongly in a final class
    cdef long long serial_tick(self) noexcept
    cdef long long serial_turn(self) noexcept
    cdef int clock_serial(self) except -1
    cdef void _set_serial_clock(self) noexcept
    cdef long long _timer1_tick(self) noexcept
    cdef int push(self, int port, int levels, long long tick) except -1
    cdef int apply_pushes(self, long long now) except -1
    @cython.locals(ports=Ports, p1=int, p3=int, changed1=int, changed3=int)
    cdef int sample_pins(self, long long cycle) except -1
    @cython.locals(ports=Ports)
    cdef inline void sample_latches(self, long long cycle) noexcept
    cdef int _inputs_changed(self, int changed1, int changed3, long long cycle) except -1
    cpdef int pin_levels(self, int port, long long cycle) except -1
    @cython.locals(shifted=int)
    cpdef int output_at(self, int output, long long tick) noexcept
    @cython.locals(edge='long long')
    cpdef long long output_after(self, int output, long long tick) noexcept
    cpdef int read(self, int address, long long cycle) except -1
    cdef int _read_rarely(self, int address, long long cycle) noexcept
    @cython.locals(timers=bint)
    cdef int write_bit(self, int address, int mask, int level, long long cycle) except -1
    cpdef int write(self, int address, int value, long long cycle) except -1
    cdef inline int _write_timer(self, int address, int value, long long cycle) except -1
    cdef inline void _note_timers(self) noexcept
    cdef void _note_clocks(self, int mode) noexcept
    @cython.locals(shift=int)
    cdef int _write_timer2(self, int address, int value, long long cycle) except -1
    cdef int write_serial(self, int address, int value, long long cycle) except -1
    cpdef long long bit_ticks(self) noexcept
    cdef int write_smod(self, int smod, long long cycle) except -1
    cdef int write_p3(self, int value, long long cycle) except -1
    cdef void taken(self, int source, long long cycle) noexcept
