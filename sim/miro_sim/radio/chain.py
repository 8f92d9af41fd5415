"""A two-state Markov chain over bit times whose states can be evaluated in any order.

A chain's state depends on its whole past, unless the draws are coupled. Here one draw u of slot i decides
for both states at once:

    u below `enter`           the state is bad from here on, whatever it was
    u at or above 1 - `leave` the state is good from here on, whatever it was
    otherwise                 the state stays

From good to bad with probability `enter`, from bad to good with `leave`: the Gilbert-Elliott chain. And the
state in slot i is settled by the last slot up to i whose draw fell into one of the two ranges, so that it is
a pure function of (seed, stream, i): one walks back until there is one, 1 / (enter + leave) steps on average.
Before slot 0 the state is good. After `reseed` the state before the first slot of the new seed is the old seed's.
"""

from __future__ import annotations

from miro_exact.rng import Stream
from miro_sim.radio.params import Bursts, Dropouts

_ONE = 1 << 32


class Chain:
    """The chain of one stream. It has no state: slot and answer of the last call are a cache.

    `first`: the first slot of its seed; `before`: the state in all slots before that.
    """

    NOT_STATE = ("*",)

    def __init__(self, params: Bursts | Dropouts, seed: int, name: str) -> None:
        self.stream = Stream(seed, name)
        self.enter, leave = params.chances()
        self.stay = _ONE - leave  # draws from here on end the bad state
        self.first = 0
        self.before = 0
        self.slot = -1
        self.answer = 0

    def reseed(self, seed: int, first: int) -> None:
        """The draws of another seed from slot `first` on."""
        self.before = self.bad(first - 1) if first > 0 else 0  # the walk into the past would use the new seed
        self.first = max(first, 0)
        self.slot = self.first - 1
        self.answer = self.before
        self.stream.reseed(seed)

    def __repr__(self) -> str:
        return f"Chain({self.stream.name!r}, enter={self.enter}, leave={_ONE - self.stay})"

    def bad(self, slot: int) -> int:
        """1 if the state in a slot (0 or greater) is bad."""
        if slot == self.slot:
            return self.answer
        if slot < self.first:
            return self.before
        known = self.slot
        answer = self.answer
        if slot < known:
            known = self.first - 1
            answer = self.before
        for index in range(slot, known, -1):
            draw = self.stream.u32(index)
            if draw < self.enter:
                answer = 1
                break
            if draw >= self.stay:
                answer = 0
                break
        self.slot = slot
        self.answer = answer
        return answer
