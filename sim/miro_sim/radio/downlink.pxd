cimport cython
from miro_exact.rng cimport Stream
from miro_sim.radio.listener cimport Listener
from miro_sim.radio.sender cimport Sender

cdef long long _BIT, _CHARACTER_TICKS


cdef class Downlink:
    cdef readonly object params, seed, name
    cdef readonly Stream jitter, lost
    cdef readonly long long jitter_ticks, lost_threshold
    cdef readonly dict listeners
    cdef readonly Sender sender
    cdef readonly list overheard, audience
    cdef readonly long long settled_tick, free_tick, busy_tick

    @cython.locals(late='long long', arrival='long long', link=Downlink, sender=Sender)
    cpdef long long send(self, long long start_tick, data, tuple bad_stop=*) except? -1
    @cython.locals(listener=Listener, sender=Sender)
    cpdef settle(self, long long until_tick)
