"""Which payloads that are not here would make a goal possible, and by which plan."""

from nondum.planning.explain.advise.advice import Advice, Way, advise
from nondum.planning.explain.advise.candidate import Candidate, Here
from nondum.planning.explain.advise.relevance import relevant
from nondum.planning.explain.advise.words import understood

__all__ = ["Advice", "Candidate", "Here", "Way", "advise", "relevant", "understood"]
