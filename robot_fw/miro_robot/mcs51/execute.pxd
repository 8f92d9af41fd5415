cimport cython

from miro_robot.mcs51.bus cimport Bus

cdef int _BREAKPOINT, _REACHED, _UNDEFINED_OPCODE, _STACK_OVERFLOW, _STACK_UNDERFLOW, _OUTSIDE_IMAGE
cdef int _MOV_DATA, _CORE, _SPREAD_FROM, _SPREAD_TO, _DEPTH

cdef class Executor:
    cdef readonly Bus bus
    cdef unsigned char rom[65538]
    cdef unsigned int lines[65536]
    cdef unsigned short line_of[256]
    cdef unsigned char iram[256]
    cdef public int pc, a, b, sp, dptr, cy, ac, ov, user_flags, bank
    cdef readonly long long cycles, start, at
    cdef long long limit, until
    cdef int stop
    cdef readonly long long instructions, idle_cycles, faults
    cdef unsigned char[::1] edges
    cdef int edge_mask, edge_before, edge_depth
    cdef int edge_outer[8]
    cdef public int highest_sp
    cdef readonly int stack_floor, stack_end

    cdef int clear(self) except -1
    cpdef begin_edges(self)
    @cython.final
    @cython.locals(place='unsigned int')
    cdef void count_edge(self, int target) noexcept
    @cython.final
    cdef void enter_edges(self) noexcept
    @cython.final
    cdef void leave_edges(self) noexcept
    @cython.locals(line='unsigned int')
    cdef unsigned int line_at(self, int address) noexcept
    cpdef int run(self, long long until_cycle) except -1
    @cython.locals(now='long long', pc='long long', line='unsigned long long', row=int, value=int)
    cpdef int go_on(self, long long until_cycle) except -1

    @cython.final
    cdef inline int read(self, int address) except -1
    @cython.final
    cdef int read_register(self, int address) except -1
    @cython.final
    cdef inline int core_register(self, int address) noexcept
    @cython.final
    cdef int write_register(self, int address, int value) except -1
    cpdef int psw(self) noexcept
    @cython.final
    cdef void write_psw(self, int value) noexcept
    @cython.final
    cdef inline int read_latched(self, int address) except -1
    @cython.final
    cdef inline int write(self, int address, int value) except -1
    @cython.final
    cdef inline int read_bit(self, int bit) except -1
    @cython.final
    cdef inline int latched_bit(self, int bit) except -1
    @cython.final
    cdef inline int write_bit(self, int bit, int level) except -1
    @cython.final
    cdef int write_register_bit(self, int address, int mask, int level) except -1
    @cython.final
    cdef inline int branch(self, int pc, int offset) noexcept
    @cython.final
    cdef inline int fork(self, int target) noexcept
    @cython.final
    cdef inline int call(self, int pc, int target) except -1
    @cython.final
    cdef inline int claim(self) except -1
    @cython.final
    @cython.locals(empty=bint)
    cdef inline int pop(self) except -1
    @cython.final
    @cython.locals(round_the_top=bint)
    cdef int set_sp(self, int value) except -1
    @cython.final
    cdef inline void add(self, int operand, int carry) noexcept
    @cython.final
    cdef inline void subtract(self, int operand) noexcept
    @cython.final
    cdef inline int compare(self, int pc, int left, int right, int offset) noexcept
    @cython.final
    cdef inline void divide(self) noexcept
    @cython.final
    cdef inline void decimal_adjust(self) noexcept
    @cython.final
    cdef int fault(self, int kind) except -1

    cdef int begin_run(self) except -1
    cdef int end_run(self) except -1
    cdef int boundary(self) except -1
    cdef int end_of_interrupt(self) except -1
    cdef int read_sfr(self, int address) except -1
    cdef int read_latch(self, int address) except -1
    cdef int write_sfr(self, int address, int value) except -1
    cdef int write_sfr_bit(self, int address, int mask, int level) except -1
    cdef int page(self) noexcept
    cdef int movx_read(self, int address) except -1
    cdef int movx_write(self, int address, int value) except -1
