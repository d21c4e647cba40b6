; What a Compton camera can do for a plan. Only words of nondum-core.
(define (domain compton-camera)
  (:requirements :strips :typing)
  (:action localise
    :parameters (?u - sensor ?t - target ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (senses ?u ?t))
    :effect (bearing-known ?t ?h)))
