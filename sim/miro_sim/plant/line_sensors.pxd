cimport cython
from miro_robot.parts.part cimport Part
from miro_sim.plant.car cimport CarPart, OnCar

cdef long long _NEVER
cdef int _SEEN, HIGH, LOW, RELEASED, _LONGEST
cdef double _SAFE

cdef class LineSensorsPart(OnCar):
    cdef readonly int count, dark_level
    cdef readonly long long look_ticks
    cdef readonly double ahead_cm[8], left_cm[8]
    cdef CarPart car
    cdef public int is_on, floors
    cdef public int held[8]

    cdef CarPart _car(self)
    @cython.locals(number=int, held=int, is_dark=int, level=int)
    cpdef due(self, long long tick)
    @cython.locals(number=int, looks=double, away_cm=double, most_cm=double, car=CarPart)
    cdef _look(self, long long tick)
