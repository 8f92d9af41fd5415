from . import plan as _plan
from .plan import Plan as Plan
from .results import read as read
from .running import run as run
from .workers import Processes as Processes

load = _plan.load_plan
parse = _plan.parse_plan

__all__: list[str]
