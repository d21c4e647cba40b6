; What a detector can do for a plan. Only words of nondum-core.
; Its cost: milliseconds of one core of a small PC for an image of 480×320 pixels.
(define (domain people-detector)
  (:requirements :strips :typing :action-costs)
  (:functions (total-cost) - number)
  (:action detect
    :parameters (?u - detector ?i - image ?o - detections ?h - host ?c - class)
    :precondition (and (ready ?u) (recognises ?u ?c) (flowing ?i) (from ?i ?h)
                       (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (from ?o ?h) (shows ?o ?c)
                 (increase (total-cost) 60))))
