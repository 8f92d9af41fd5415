from miro_host.pilot cimport Pilot
from miro_robot.board cimport Board
from miro_robot.lm629.chip cimport Lm629
from miro_sim.plant.drive cimport DifferentialDrive

cdef long long CYCLE_TICKS, GRID_TICKS


cdef class Robot:
    cdef readonly object spec, network, slot, reference, log
    cdef readonly Board board
    cdef readonly Pilot pilot
    cdef readonly DifferentialDrive drive
    cdef readonly list counter_addresses
    cdef public tuple marks
    cdef public list asked, noted
    cdef public long long grid_tick

    cpdef note_from(self, long long tick)
    cpdef int run(self, long long tick) except -1
    cdef int _run(self, long long tick) except -1
    cpdef steer(self, measured, telemetry, long long tick)
    cpdef counter(self, int index)
    cpdef record(self, long long tick, measured, command)


cdef _axis(Lm629 chip)
cdef _control(command)
