; Lasting behaviours feed each other: cameras, a detector, a tracker, a base, a pointing head.
; What stream, detect, track, drive and point add holds only while they run.
(define (domain follow)
  (:types camera detector tracker base pointer sensor speaker - unit
          image detections twist - stream
          unit stream host class source - object)
  (:predicates (ready ?u - unit) (on ?u - unit ?h - host) (idle ?u - unit)
               (output ?u - unit ?s - stream) (free ?s - stream) (flowing ?s - stream)
               (recognises ?u - unit ?c - class) (shows ?s - stream ?c - class)
               (steers ?s - twist ?h - host ?c - class) (bearing-known ?t - source ?h - host)
               (following ?h - host ?c - class) (pointing ?h - host ?t - source)
               (found ?c - class ?h - host) (reported ?c - class ?h - host))
  (:action stream
    :parameters (?u - camera ?o - image ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o)))
  (:action detect
    :parameters (?u - detector ?i - image ?o - detections ?h - host ?c - class)
    :precondition (and (ready ?u) (recognises ?u ?c) (flowing ?i) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (shows ?o ?c)))
  (:action track
    :parameters (?u - tracker ?d - detections ?o - twist ?h - host ?c - class)
    :precondition (and (ready ?u) (flowing ?d) (shows ?d ?c) (output ?u ?o) (free ?o))
    :effect (and (not (free ?o)) (flowing ?o) (steers ?o ?h ?c)))
  (:action drive
    :parameters (?u - base ?s - twist ?h - host ?c - class)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (steers ?s ?h ?c))
    :effect (and (not (idle ?u)) (following ?h ?c)))
  (:action point
    :parameters (?u - pointer ?t - source ?h - host)
    :precondition (and (ready ?u) (on ?u ?h) (idle ?u) (bearing-known ?t ?h))
    :effect (and (not (idle ?u)) (pointing ?h ?t)))
  (:action localise
    :parameters (?u - sensor ?t - source ?h - host)
    :precondition (and (ready ?u) (on ?u ?h))
    :effect (bearing-known ?t ?h))
  (:action watch
    :parameters (?u - tracker ?d - detections ?h - host ?c - class)
    :precondition (and (ready ?u) (flowing ?d) (shows ?d ?c))
    :effect (found ?c ?h))
  (:action report
    :parameters (?u - speaker ?c - class ?h - host)
    :precondition (and (ready ?u) (found ?c ?h))
    :effect (reported ?c ?h)))
