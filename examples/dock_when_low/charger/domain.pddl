; What a charger can do for a plan. Its condition says (low-battery ?h) while the battery is low.
(define (domain charger)
  (:requirements :strips :typing)
  (:types charger - unit)
  (:predicates
    (low-battery ?h - host)
    (charged ?h - host)) ; a goal: the body has been at the charger
  (:action dock
    :parameters (?u - charger ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (charged ?h)))
