cimport cython

from miro_robot.inspect.watcher cimport Watcher
from miro_robot.mcs51.cpu cimport Cpu
from miro_robot.mcs51.interrupts cimport Interrupts
from miro_robot.mcs51.timers cimport Timers
from miro_robot.mcs51.uart cimport Uart

cdef int _PLACES, _XRAM, _SCALAR, _LOCAL, _FIRST, _SECOND, _INDIRECT, _DPTR, _PAGE
cdef int _TORN_READ, _TORN_WRITE, _LOST, _SHARED, _SFRS, _EA, _CHECKED, _DEC, _DJNZ, _SOON, _NO_TIMERS
cdef int _CALL, _RET, _RETI, _PUSH, _CLEAR, _JBC, _MOVC, _MOVX_READ, _MOVX_WRITE
cdef int _SP, _SCON, _SBUF, _RI_BIT, _RI, _MODES, _TL0, _TH1, _TL2, _TH2
cdef long long _NEVER
cdef int _LONGEST_GAP, _ENDED
cdef int _DEEPEST, _GROWTHS, _NEAR, _AGAIN, _IN_CODE, _ENOUGH
cdef int _REGISTERS, _RET_OF_INTERRUPT, _RETI_OF_CALL, _OVERWRITTEN, _UNBALANCED, _LEAK
cdef int _CUT_OFF, _UNREAD, _TIMER, _NO_RAM, _NO_CODE, _CONST, _UNWRITTEN, _OVERRUN

cdef class Sanitizer(Watcher):
    cdef unsigned char reads[256]
    cdef unsigned char writes[256]
    cdef unsigned char constant[256]
    cdef int line_of[65536]
    cdef unsigned char kind_of[65792]
    cdef int key_of[65792]
    cdef int readers[394752]
    cdef int writers[394752]
    cdef long long read_step[197376]
    cdef long long write_step[197376]
    cdef long long zero_step[197376]
    cdef int zeroers[394752]
    cdef int read_pc[197376]
    cdef int write_pc[197376]
    cdef unsigned int read_seen[197376]
    cdef unsigned int write_seen[197376]
    cdef int line[3]
    cdef long long began[3]
    cdef int serving[3]
    cdef long long entered[3]
    cdef long long last_open[6]
    cdef long long step, closed
    cdef int level, open
    cdef long long priorities
    cdef int known_pair[65536]
    cdef int known_open[65536]
    cdef readonly dict pairs, events, notes
    cdef int ram, put_generic, a, scon, overruns, depth, from_reset, sent_pc, unread, cleared_pc
    cdef long long sent_tick
    cdef unsigned char written[65536]
    cdef unsigned char special[256]
    cdef int frame_sp[128]
    cdef int frame_back[128]
    cdef int frame_entry[128]
    cdef int frame_source[128]
    cdef int saved[1664]
    cdef int leak_sp[65536]
    cdef int leak_count[65536]
    cdef long long level_steps[3]
    cdef int half[9]
    cdef long long half_step[9]
    cdef int half_pc[9]
    cdef int other_pc[9]
    cdef int copied[65536]
    cdef readonly int reads_sbuf
    cdef Interrupts interrupts
    cdef long long tick

    @cython.locals(opcode=int, line=int, form=int, place=int, scon=int, uart=Uart)
    cpdef executed(self, Cpu cpu, int pc, long long start)
    cpdef ran(self, Cpu cpu, long long start)
    @cython.locals(direct=int)
    cdef inline int _place(self, Cpu cpu, int form, int pc, int opcode) noexcept
    @cython.locals(level=int, key=int, at=int, kind=int, seen='unsigned int', bit='unsigned int')
    cdef _read(self, int place, int pc)
    @cython.locals(level=int, key=int, at=int, kind=int, seen='unsigned int', bit='unsigned int')
    cdef _write(self, int place, int pc, int constant)
    @cython.locals(higher=int, at=int, sources=int, source=int)
    cdef _pair(self, int kind, int first, int pc, long long since, int key)
    @cython.locals(open_now=int, priorities='long long', source=int, timers=int, due=int)
    cdef _look(self, Cpu cpu)
    @cython.locals(key=int)
    cdef _zeroed(self, int place, int pc)
    @cython.locals(at=int)
    cdef _decrement(self, int place, int pc)
    cpdef int zeroer(self, int source, int key) noexcept
    cpdef int reader(self, int source, int key) noexcept
    cpdef int writer(self, int source, int key) noexcept
    cdef _lost(self, int pc)
    cdef _note(self, int mistake, int pc, int other, int which)
    @cython.locals(timer=int, timers=Timers)
    cdef _read_register(self, Cpu cpu, int address, int pc)
    @cython.locals(at=int, passed='long long', first=int)
    cdef _half(self, int timer, int high, int running, int pc)
    @cython.locals(uart=Uart)
    cdef _write_register(self, Cpu cpu, int address, int pc)
    cdef _received(self)
    cdef _cleared(self, int pc)
    @cython.locals(address=int, page=bint)
    cdef _special(self, Cpu cpu, int special, int pc, int opcode)
    @cython.locals(after=int)
    cdef bint _in_gap(self, Cpu cpu, int address, int last)
    @cython.locals(last=int)
    cdef _grown(self, int sp, int pc)
    @cython.locals(at=int, register=int)
    cdef _enter(self, Cpu cpu, int entry, int back, int source)
    cdef int _register(self, Cpu cpu, int register) noexcept
    @cython.locals(before=int, below=int, at=int, source=int, register=int)
    cdef _left(self, Cpu cpu, int pc, int by_reti)
