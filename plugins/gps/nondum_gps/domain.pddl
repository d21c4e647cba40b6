; What a GPS receiver can do for a plan. The condition `position` says (position-known ?h).
(define (domain gps)
  (:requirements :strips :typing)
  (:predicates
    (position-known ?h - host) ; with a value: the latest fix
    (position-told ?h - host)) ; a goal: somebody has been told where that body is
  (:valued position-known - gps-fix)
  (:action tell-position
    :parameters (?u - sensor ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (position-known ?h))
    :effect (position-told ?h)))
