cimport cython
from miro_host.station cimport Station
from miro_sim.radio.downlink cimport Downlink
from miro_sim.radio.uplink cimport Uplink
from miro_host.telemetry_receiver cimport TelemetryReceiver
from miro_sim.world.outbox cimport Outbox
from miro_sim.world.robot cimport Robot

cdef long long SETTLE_TICKS


cdef class Network:
    cdef readonly object spec, index, actions, log
    cdef readonly TelemetryReceiver telemetry
    cdef readonly Outbox outbox
    cdef public object sight
    cdef readonly Station station
    cdef readonly Downlink downlink
    cdef readonly Uplink uplink
    cdef readonly list robots, draws
    cdef readonly str host
    cdef readonly long long compute_ticks
    cdef public long long frames_sent
    cdef public list heard, sent, seen

    @cython.locals(robot=Robot)
    cpdef begin_period(self, long long tick)
    cpdef send_due(self, long long rendezvous_tick)
    cpdef settle(self, long long rendezvous_tick)
    @cython.locals(robot=Robot)
    cdef _transmit(self, long long start_tick, list commands)
    @cython.locals(robot=Robot, stopped=cython.bint)
    cpdef bint run(self, long long tick) except -1
    cpdef hear(self, long long tick)
    cpdef list end_period(self)
