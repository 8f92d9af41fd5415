# memory.pyx declares its classes itself: no other module builds upon them.
