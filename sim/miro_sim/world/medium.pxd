from miro_sim.world.outbox cimport Outbox

cdef long long SETTLE_TICKS


cdef class Medium:
    cdef readonly object index, actions, log
    cdef readonly Outbox outbox
    cdef readonly list devices
    cdef readonly str host
    cdef readonly long long latency
    cdef public list heard, sent, seen

    cpdef begin_period(self, long long tick)
    cpdef send_due(self, long long rendezvous_tick)
    cpdef send(self, sent)
    cpdef settle(self, long long rendezvous_tick)
    cpdef bint run(self, long long tick) except -1
    cpdef hear(self, long long tick)
    cpdef list end_period(self)
    cpdef long long free_tick(self) except -1
