from miro_robot.mcs51.bus cimport Bus
from miro_robot.mcs51.cpu cimport Cpu

cdef class XramBus(Bus):
    cdef unsigned char memory[65536]
    cdef object sent, faulted
    cdef public Cpu code_of

    cpdef int movx_read(self, int address, long long tick) except -1
    cpdef movx_write(self, int address, int value, long long tick)
    cpdef byte_sent(self, int value, long long tick)
    cpdef fault(self, int kind, int pc, long long tick)
    cpdef fill(self, bytes content)
