from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.cpu cimport Cpu

cdef class XramBus(Bus):
    cdef unsigned char memory[65536]
    cdef object sent, faulted, listening
    cdef public Cpu code_of

    cpdef fill(self, bytes content)
