from miro_robot.parts.part cimport Part

cdef class LedPart(Part):
    cdef int lit
    cdef public int on
    cdef public long long flashes
