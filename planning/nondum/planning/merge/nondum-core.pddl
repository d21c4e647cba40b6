; nondum-core 1: the words that independently written plugins share.
; Who writes a predicate: H the host (plugins may read it, and a lasting action may delete `idle` and
; `free`, which is how it takes something for as long as it runs), P the plugins.
(define (domain nondum-core)
  (:types
    host class target place unit stream - object
    camera detector tracker base pointer sensor speaker microphone arm gripper light - unit
    image depth points detections twist pose audio text scalar - stream
    gps-fix imu-data laser-scan battery-state occupancy-grid key-values - stream)
  (:predicates
    (self ?h - host)                             ; H the host that plans
    (on ?u - unit ?h - host)                     ; H the unit is part of that body
    (ready ?u - unit)                            ; H its component is healthy, its devices are there
    (idle ?u - unit)                             ; H nothing uses it, or not as many as it serves
    (output ?u - unit ?s - stream)               ; H an output slot of the unit
    (free ?s - stream)                           ; H the slot is unused
    (flowing ?s - stream)                        ; P messages arrive
    (from ?s - stream ?h - host)                 ; P whose body sensed what the stream tells
    (recognises ?u - unit ?c - class)            ; P what a perceiver can find
    (senses ?u - unit ?t - target)               ; P what a perceiver can find
    (shows ?s - stream ?c - class)               ; P the stream tells about such things
    (steers ?s - twist ?h - host ?c - class)     ; P obeying it keeps that body towards such a thing
    (bearing-known ?t - target ?h - host)        ; P with a bearing, its frame and its stamp
    (following ?h - host ?c - class)             ; P a goal: the body keeps near such a thing
    (pointing ?h - host ?t - target)             ; P a goal: something of that body points at it
    (found ?c - class ?h - host)                 ; P a goal: that body has seen such a thing
    (reported ?c - class ?h - host))             ; P a goal: that body has told people of it
  (:valued bearing-known - bearing))
