"""AFL++: the target process it speaks to, and how afl-fuzz is started, watched and ended."""
