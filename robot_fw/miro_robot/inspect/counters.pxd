cimport cython

from miro_robot.inspect.watcher cimport Watcher
from miro_robot.mcs51.cpu cimport Cpu

cdef int _SPACE

cdef class Counters(Watcher):
    cdef unsigned char length_of[256]
    cdef long long executions[65536]
    cdef long long cycles[65536]
    cdef long long jumps[65536]

    cpdef executed(self, Cpu cpu, int pc, long long start)
    cpdef long long executed_at(self, int address)
    cpdef long long cycles_at(self, int address)
    cpdef long long jumped_at(self, int address)
    @cython.locals(address=int)
    cpdef list addresses(self)
