from miro_robot.processor_board cimport ProcessorBoard

cdef long long CYCLE_TICKS
cdef int TRUE


cdef class Device:
    cdef readonly ProcessorBoard board
    cdef readonly object network, slot, log, image
    cdef readonly list counter_addresses
    cdef public tuple marks
    cdef public list asked, pin_moves

    cpdef int run(self, long long tick) except -1
    cpdef long long sample_tick(self) except -1
    cpdef counter(self, int index)
