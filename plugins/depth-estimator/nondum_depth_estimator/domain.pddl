; What a depth estimator can do for a plan. Words of nondum-core, its own type, and one goal.
; Its cost: milliseconds of one core of a small PC for a network of 256×256 pixels.
(define (domain depth-estimator)
  (:requirements :strips :typing :action-costs)
  (:types depth-estimator - camera)
  (:predicates
    (distances-known ?h - host))  ; a goal: how far away things are that this body's camera sees
  (:functions (total-cost) - number)
  (:action estimate
    :parameters (?u - depth-estimator ?i - image ?o - depth ?h - host)
    :precondition (and (ready ?u) (flowing ?i) (from ?i ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (distances-known ?h)
                 (increase (total-cost) 300))))
