; What a camera can do for a plan. Only words of nondum-core.
(define (domain recorded-camera)
  (:requirements :strips :typing)
  (:action stream
    :parameters (?u - camera ?o - image ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h))))
