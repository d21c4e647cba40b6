; What a tracker can do for a plan. Only words of nondum-core.
(define (domain visual-tracker)
  (:requirements :strips :typing)
  (:action track
    :parameters (?u - tracker ?d - detections ?o - twist ?h - host ?c - class)
    :precondition (and (ready ?u) (flowing ?d) (from ?d ?h) (shows ?d ?c) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (steers ?o ?h ?c)))
  (:action watch
    :parameters (?u - tracker ?d - detections ?h - host ?c - class)
    :precondition (and (ready ?u) (flowing ?d) (from ?d ?h) (shows ?d ?c))
    :effect (found ?c ?h)))
