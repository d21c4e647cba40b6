; Rovers sample the ground, take pictures and send both home.
(define (domain rovers)
  (:types rover waypoint objective camera)
  (:predicates (ready ?r - rover) (at ?r - rover ?x - waypoint)
               (path ?r - rover ?x - waypoint ?y - waypoint) (rests ?x - waypoint ?y - waypoint)
               (sample ?x - waypoint) (full ?r - rover) (vacant ?r - rover)
               (analysed ?r - rover ?x - waypoint) (carries ?r - rover ?c - camera)
               (calibrated ?c - camera) (sees ?x - waypoint ?o - objective)
               (photographed ?r - rover ?o - objective) (home ?x - waypoint)
               (sent-analysis ?x - waypoint) (sent-image ?o - objective))
  (:action drive
    :parameters (?r - rover ?from - waypoint ?to - waypoint)
    :precondition (and (ready ?r) (at ?r ?from) (path ?r ?from ?to))
    :effect (and (not (at ?r ?from)) (at ?r ?to)))
  (:action analyse
    :parameters (?r - rover ?x - waypoint)
    :precondition (and (ready ?r) (at ?r ?x) (sample ?x) (vacant ?r))
    :effect (and (not (vacant ?r)) (full ?r) (analysed ?r ?x)))
  (:action drop
    :parameters (?r - rover)
    :precondition (and (ready ?r) (full ?r))
    :effect (and (not (full ?r)) (vacant ?r)))
  (:action calibrate
    :parameters (?r - rover ?c - camera ?o - objective ?x - waypoint)
    :precondition (and (ready ?r) (carries ?r ?c) (at ?r ?x) (sees ?x ?o))
    :effect (calibrated ?c))
  (:action photograph
    :parameters (?r - rover ?c - camera ?o - objective ?x - waypoint)
    :precondition (and (ready ?r) (carries ?r ?c) (calibrated ?c) (at ?r ?x) (sees ?x ?o))
    :effect (and (not (calibrated ?c)) (photographed ?r ?o)))
  (:action send-analysis
    :parameters (?r - rover ?x - waypoint ?here - waypoint ?home - waypoint)
    :precondition (and (ready ?r) (analysed ?r ?x) (at ?r ?here) (home ?home) (rests ?here ?home))
    :effect (sent-analysis ?x))
  (:action send-image
    :parameters (?r - rover ?o - objective ?here - waypoint ?home - waypoint)
    :precondition (and (ready ?r) (photographed ?r ?o) (at ?r ?here) (home ?home)
                       (rests ?here ?home))
    :effect (sent-image ?o)))
