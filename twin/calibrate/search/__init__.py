"""Global search in the unit box by metaheuristics that take turns: `search`."""

from twin.calibrate.search.course import Stage
from twin.calibrate.search.driver import Best, Evaluate, search
from twin.calibrate.search.journal import Journal, SearchError
from twin.calibrate.search.members import MEMBERS

__all__ = ["MEMBERS", "Best", "Evaluate", "Journal", "SearchError", "Stage", "search"]
