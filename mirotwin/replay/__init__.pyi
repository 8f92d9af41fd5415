from .lockstep import StateDifference as StateDifference
from .lockstep import first_difference as first_difference

__all__: list[str]
