; What a mobile base can do for a plan. Only words of nondum-core.
(define (domain mobile-base)
  (:requirements :strips :typing)
  (:action drive
    :parameters (?u - base ?s - twist ?h - host ?c - class)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (steers ?s ?h ?c))
    :effect (and (not (idle ?u)) (following ?h ?c))))
