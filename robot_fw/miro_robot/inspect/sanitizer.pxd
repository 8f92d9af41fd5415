cimport cython

from miro_robot.inspect.watcher cimport Watcher
from miro_robot.mcs51.cpu cimport Cpu
from miro_robot.mcs51.interrupts cimport Interrupts

cdef int _PLACES, _XRAM, _SCALAR, _LOCAL, _FIRST, _SECOND, _INDIRECT, _DPTR, _PAGE
cdef int _TORN_READ, _TORN_WRITE, _LOST, _SHARED, _SFRS, _EA

cdef class Sanitizer(Watcher):
    cdef unsigned char reads[256]
    cdef unsigned char writes[256]
    cdef unsigned char constant[256]
    cdef int line_of[65536]
    cdef unsigned char kind_of[65792]
    cdef int key_of[65792]
    cdef int readers[394752]
    cdef int writers[394752]
    cdef long long read_step[197376]
    cdef long long write_step[197376]
    cdef int read_pc[197376]
    cdef int write_pc[197376]
    cdef unsigned int read_seen[197376]
    cdef unsigned int write_seen[197376]
    cdef int line[3]
    cdef long long began[3]
    cdef int serving[3]
    cdef long long last_open[6]
    cdef long long step, closed
    cdef int level, open, priorities
    cdef int known_pair[65536]
    cdef int known_open[65536]
    cdef readonly dict pairs, events
    cdef Interrupts interrupts
    cdef long long tick

    @cython.locals(opcode=int, line=int, form=int, place=int)
    cpdef executed(self, Cpu cpu, int pc, long long start)
    @cython.locals(direct=int)
    cdef inline int _place(self, Cpu cpu, int form, int pc, int opcode) noexcept
    @cython.locals(level=int, key=int, at=int, kind=int, seen='unsigned int', bit='unsigned int')
    cdef _read(self, int place, int pc)
    @cython.locals(level=int, key=int, at=int, kind=int, seen='unsigned int', bit='unsigned int')
    cdef _write(self, int place, int pc, int constant)
    @cython.locals(higher=int, at=int, sources=int, source=int)
    cdef _pair(self, int kind, int first, int pc, long long since, int key)
    @cython.locals(open_now=int, priorities=int, source=int)
    cdef _look(self, Cpu cpu)
    cpdef int reader(self, int source, int key) noexcept
    cpdef int writer(self, int source, int key) noexcept
