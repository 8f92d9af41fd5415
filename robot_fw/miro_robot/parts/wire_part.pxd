from miro_robot.parts.part cimport Part


cdef class WirePart(Part):
    cdef public int on
    cdef public long long lost
