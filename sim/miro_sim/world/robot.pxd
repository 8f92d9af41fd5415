cimport cython
from miro_host.pilot cimport Pilot
from miro_robot.board cimport Board
from miro_robot.lm629.chip cimport Lm629
from miro_sim.plant.drive cimport DifferentialDrive
from miro_sim.world.device cimport Device

cdef long long GRID_TICKS


cdef class Robot(Device):
    cdef readonly object spec, noise
    cdef readonly Pilot pilot
    cdef readonly DifferentialDrive drive
    cdef public list noted
    cdef public long long grid_tick

    cpdef note_from(self, long long tick)
    cpdef steer(self, measured, telemetry, long long tick)
    cpdef record(self, long long tick, measured, command)


cdef _axis(Lm629 chip)
cdef _control(command)
