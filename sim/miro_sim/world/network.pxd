cimport cython
from miro_host.station cimport Station
from miro_sim.radio.downlink cimport Downlink
from miro_sim.radio.uplink cimport Uplink
from miro_host.telemetry_receiver cimport TelemetryReceiver
from miro_sim.world.medium cimport Medium
from miro_sim.world.robot cimport Robot

cdef long long SETTLE_TICKS


cdef class Network(Medium):
    cdef readonly object spec
    cdef readonly TelemetryReceiver telemetry
    cdef public object sight
    cdef readonly Station station
    cdef readonly Downlink downlink
    cdef readonly Uplink uplink
    cdef readonly list draws
    cdef readonly long long compute_ticks
    cdef public long long frames_sent

    @cython.locals(robot=Robot)
    cpdef begin_period(self, long long tick)
    @cython.locals(robot=Robot)
    cdef _transmit(self, long long start_tick, list commands)
    @cython.locals(robot=Robot, stopped=cython.bint)
    cpdef bint run(self, long long tick) except -1
