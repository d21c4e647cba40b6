; What a pan-tilt unit can do for a plan. Only words of nondum-core.
(define (domain pan-tilt-unit)
  (:requirements :strips :typing)
  (:action point
    :parameters (?u - pointer ?t - target ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (bearing-known ?t ?h))
    :effect (and (not (idle ?u)) (pointing ?h ?t))))
