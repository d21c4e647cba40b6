"""Which payloads that are not here would make a goal possible, and by which plan."""

from nondum.planning.advise.advice import Advice, Way, advise
from nondum.planning.advise.candidate import Candidate, Here
from nondum.planning.advise.relevance import relevant
from nondum.planning.advise.words import understood

__all__ = ["Advice", "Candidate", "Here", "Way", "advise", "relevant", "understood"]
