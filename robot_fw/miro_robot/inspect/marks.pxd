cimport cython

from miro_robot.mcs51.cpu cimport Cpu
from miro_robot.mcs51.execute cimport Executor

cdef int _BREAKPOINT

cdef class MarkInspector:
    cdef readonly Cpu cpu
    cdef public dict marked
    cdef public object ask
    cdef public object others

    cpdef int run(self, long long until_cycle) except -1
    @cython.locals(cpu=Cpu, reason=int, place=int)
    cdef int _pass_marks(self, long long until_cycle) except -1
