cimport cython

from miro_robot.mcs51.cpu cimport Cpu

cdef int _VECTOR, _VECTOR_STEP, _CALL_CYCLES

cdef class Watcher:
    cpdef attached(self, Cpu cpu)
    cpdef resumed(self, Cpu cpu)
    cpdef detached(self, Cpu cpu)
    cpdef starting(self, Cpu cpu)
    cpdef executed(self, Cpu cpu, int pc, long long start)
    cpdef interrupted(self, Cpu cpu, int source, int pc, long long start)
    cpdef slept(self, Cpu cpu, long long start, long long end)
    cpdef ran(self, Cpu cpu, long long start)

cdef class Inspector:
    cdef readonly Cpu cpu
    cdef public list watchers, once
    cdef readonly list held

    @cython.locals(watcher=Watcher)
    cpdef int run(self, long long until_cycle) except -1
    @cython.locals(watcher=Watcher)
    cdef int _step(self) except -1
    @cython.locals(woken=bint, watcher=Watcher)
    cdef int _sleep(self, long long until_cycle) except -1
    @cython.locals(watcher=Watcher)
    cdef int _tell_interrupted(self, int pc, long long start) except -1
