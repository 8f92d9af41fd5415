from miro_robot.mcs51.bus cimport Bus

cdef class XramBus(Bus):
    cdef unsigned char memory[65536]
