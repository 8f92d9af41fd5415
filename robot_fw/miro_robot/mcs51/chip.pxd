cimport cython

from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.line cimport Line
from miro_robot.mcs51.peripherals cimport Peripherals

cdef long long NEVER_TICK
cdef int _OUTSIDE, _MARK, _STOP_REQUESTED, _REPLAN
cdef int _P0, _PCON, _IE, _IP, _SMOD, _PD, _IDL, _PCON_BITS
cdef int _SAMPLED_P1, _SAMPLED_P3
cdef int _READ_SAMPLE, _WRITE_RISES, _FLOATING, _ONE_INSTRUCTION
cdef unsigned short _LINE[256]

cdef class Chip:
    cdef readonly Bus bus
    cdef readonly Peripherals peripherals
    cdef readonly Line rxd, txd
    cdef unsigned char rom[65538]
    cdef unsigned int lines[65536]
    cdef unsigned char iram[256]
    cdef public int pc, a, b, sp, dptr, cy, ac, ov, user_flags, bank
    cdef readonly long long cycles, start, at
    cdef long long limit, until
    cdef int stop
    cdef readonly long long instructions, idle_cycles, faults
    cdef readonly int pcon, idle, powered_down
    cdef long long next_event, blocked
    cdef public long long main_loop_limit
    cdef long long next_mark, marks
    cdef int interrupt_returns[2]
    cdef public int stop_asleep, inner_xram
    cdef public object inspector
    cdef unsigned char[::1] edges
    cdef int edge_mask, edge_before, edge_depth
    cdef int edge_outer[8]
    cdef public int highest_sp
    cdef readonly int stack_floor, stack_end

    cpdef int psw(self) noexcept
    cdef void write_psw(self, int value) noexcept
    @cython.locals(address=int, first=int, end=int)
    cpdef load(self, bytes image, used=*)
    cdef void _erase(self) noexcept
    @cython.locals(line='unsigned int')
    cdef unsigned int line_at(self, int address) noexcept
    cpdef int write_code(self, int address, int value) except -1
    cpdef is_loaded(self, int address)
    cpdef int code_at(self, int address) noexcept
    cpdef request_stop(self)
    cdef void replan(self) noexcept
    cpdef int set_external(self, int port, int levels, long long tick) except -1
    cpdef rxd_changed(self)
    cpdef asleep(self)
    cpdef int peek_iram(self, int address) noexcept
    cdef int fault(self, int kind) except -1
    cdef long long _next_look(self) noexcept
    cdef bint _taken_over(self) noexcept
    cdef int _block(self) except -1
    cdef int _expect(self, long long earliest) except -1
    cdef int _other_register(self, int address, long long cycle) except -1
    cdef int read_sfr(self, int address) except -1
    cdef int write_sfr_bit(self, int address, int mask, int level) except -1
    cdef int write_sfr(self, int address, int value) except -1
    @cython.final
    cdef inline int _written(self, int address, int sooner) except -1
    cdef int write_pcon(self, int value) except -1
    @cython.final
    cdef int write_port(self, int port, int value) except -1
    cdef int movx_read(self, int address) except -1
    cdef inline int page(self) noexcept
    cdef int movx_write(self, int address, int value) except -1
