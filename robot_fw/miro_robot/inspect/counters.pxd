from miro_robot.inspect.watcher cimport Watcher

cdef int _SPACE

cdef class Counters(Watcher):
    cdef unsigned char length_of[256]
    cdef long long executions[65536]
    cdef long long cycles[65536]
    cdef long long jumps[65536]

    cpdef long long executed_at(self, int address)
    cpdef long long cycles_at(self, int address)
    cpdef long long jumped_at(self, int address)

cdef int _RETI, _CALL_CYCLES, _DEPTH

cdef class Activity(Watcher):
    cdef readonly long long cycles, asleep_cycles
    cdef readonly int highest_sp
    cdef readonly long long highest_sp_tick
    cdef readonly list interrupts
    cdef long long ended[6]
    cdef long long began[8]
    cdef int serving[8]
    cdef int depth

    cdef int _leave(self, long long cycle) except -1
