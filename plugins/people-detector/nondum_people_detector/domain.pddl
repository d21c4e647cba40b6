; What a detector can do for a plan. Only words of nondum-core.
(define (domain people-detector)
  (:requirements :strips :typing)
  (:action detect
    :parameters (?u - detector ?i - image ?o - detections ?h - host ?c - class)
    :precondition (and (ready ?u) (recognises ?u ?c) (flowing ?i) (from ?i ?h)
                       (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (shows ?o ?c))))
