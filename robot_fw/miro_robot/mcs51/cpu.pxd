cimport cython

from miro_robot.mcs51.execute cimport Executor
from miro_robot.mcs51.line cimport Line
from miro_robot.mcs51.peripherals cimport Peripherals

cdef long long NEVER_TICK
cdef int _OUTSIDE, _MARK
cdef int _STOP_REQUESTED, _REPLAN
cdef int _WIRE_FULL
cdef int _P0, _PCON, _IE, _IP
cdef int _SMOD, _PD, _IDL
cdef int _PCON_BITS
cdef int _READ_SAMPLE, _WRITE_RISES
cdef int _FLOATING
cdef int _MAIN_LOOP_STARVED, _MARK_CYCLES, _ONE_INSTRUCTION

@cython.final
cdef class Cpu(Executor):
    cdef readonly Peripherals peripherals
    cdef readonly Line rxd, txd
    cdef readonly int pcon, idle, powered_down
    cdef long long next_event, blocked
    cdef public long long main_loop_limit
    cdef long long next_mark, marks
    cdef public int stop_asleep
    cdef public object inspector

    @cython.locals(address=int, first=int, end=int)
    cpdef load(self, bytes image, used=*)
    cdef void _erase(self) noexcept
    cpdef int write_code(self, int address, int value) except -1
    cpdef is_loaded(self, int address)
    cpdef int code_at(self, int address) noexcept
    cpdef int step(self) except -1
    cpdef request_stop(self)
    cdef void replan(self) noexcept
    cpdef int set_external(self, int port, int levels, long long tick) except -1
    cpdef asleep(self)
    cpdef int peek_iram(self, int address) noexcept
    cpdef int sfr(self, int address) except -1
    @cython.locals(blocked=bint)
    cdef inline int _attend(self, long long now) except -1
    cdef int _note_end(self, long long now) except -1
    cdef int _look_for_sleep(self, long long now) except -1
    cdef int _watch_main_loop(self, long long now) except -1
    cdef inline bint _taken_over(self) noexcept
    cdef int _enter(self, int source) except -1
    cdef inline int _block(self) except -1
    cdef inline int _expect(self, long long earliest) except -1
    cdef inline long long _next_look(self) noexcept
    cdef inline int _written(self, int address, int sooner) except -1
    cdef int register(self, int address, long long cycle) except -1
    cdef inline int _other_register(self, int address, long long cycle) except -1
    cdef int write_pcon(self, int value) except -1
    cdef int write_port(self, int port, int value) except -1
