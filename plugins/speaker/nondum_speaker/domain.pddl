; What a speaker can do for a plan. Only words of nondum-core.
(define (domain speaker)
  (:requirements :strips :typing)
  (:action report
    :parameters (?u - speaker ?c - class ?h - host)
    :precondition (and (ready ?u) (found ?c ?h))
    :effect (reported ?c ?h)))
