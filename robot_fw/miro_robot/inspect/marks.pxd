from miro_robot.mcs51.cpu cimport Cpu

cdef int BREAKPOINT

cdef class MarkInspector:
    cdef readonly Cpu cpu
    cdef public dict marked
    cdef public object ask, others

    cpdef int run(self, long long until_cycle) except -1
    cdef int _pass_marks(self, long long until_cycle) except -1
