; What a language model can do for a plan: be in memory before it is asked. Words of nondum-core, its
; own type, and one goal. Its cost: milliseconds of one core of a small PC for a model of 1 GB.
(define (domain language-model)
  (:requirements :strips :typing :action-costs)
  (:types language-model - unit)
  (:predicates
    (language-model-loaded ?h - host))  ; a goal: words that match no phrase are translated at once
  (:functions (total-cost) - number)
  (:action load
    :parameters (?u - language-model ?h - host)
    :precondition (and (ready ?u))
    :effect (and (language-model-loaded ?h) (increase (total-cost) 2000))))
