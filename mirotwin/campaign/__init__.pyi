from .file import load as load
from .file import parse as parse
from .plan import Plan as Plan
from .results import read as read
from .running import run as run
from .workers import Processes as Processes

__all__: list[str]
