; One behaviour, so that a plan can be asked for.
(define (domain bench-small)
  (:requirements :strips :typing)
  (:predicates (weighed-small ?h - host))
  (:action weigh
    :parameters (?u - sensor ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (weighed-small ?h)))
