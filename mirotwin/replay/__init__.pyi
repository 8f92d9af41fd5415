from .lockstep.pair import StateDifference as StateDifference
from .lockstep.pair import first_difference as first_difference

__all__: list[str]
