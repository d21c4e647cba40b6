; What $name can do for a plan. `lit` is its own word; the others are nondum-core's.
(define (domain $name)
  (:requirements :strips :typing)
  (:predicates (lit ?h - host))
  (:action shine
    :parameters (?u - light ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (lit ?h)))
