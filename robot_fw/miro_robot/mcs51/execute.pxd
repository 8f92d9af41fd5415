cimport cython

from miro_robot.mcs51.core cimport Core

cdef int _BREAKPOINT, _REACHED
cdef int _UNDEFINED_OPCODE
cdef int _STACK_OVERFLOW
cdef int _STACK_UNDERFLOW
cdef int _MOV_DATA
cdef int _CORE
cdef int _OUTSIDE_IMAGE

cdef class Executor(Core):
    cpdef int run(self, long long until_cycle) except -1
    @cython.locals(iram='unsigned char *', rom='unsigned char *', now='long long', count='long long',
                   pc='long long', line='unsigned long long', row=int, at='long long', address=int, value=int)
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
