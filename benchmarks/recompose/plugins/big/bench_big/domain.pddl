; One behaviour, so that a plan can be asked for.
(define (domain bench-big)
  (:requirements :strips :typing)
  (:predicates (weighed-big ?h - host))
  (:action weigh
    :parameters (?u - sensor ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (weighed-big ?h)))
