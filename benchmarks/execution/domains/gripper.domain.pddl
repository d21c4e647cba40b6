; A robot with two hands carries balls from room to room.
(define (domain gripper)
  (:types robot hand ball room)
  (:predicates (ready ?r - robot) (has ?r - robot ?h - hand) (at ?r - robot ?x - room)
               (in ?b - ball ?x - room) (held ?b - ball ?h - hand) (empty ?h - hand))
  (:action move
    :parameters (?r - robot ?from - room ?to - room)
    :precondition (and (ready ?r) (at ?r ?from) (not (= ?from ?to)))
    :effect (and (not (at ?r ?from)) (at ?r ?to)))
  (:action pick
    :parameters (?r - robot ?h - hand ?b - ball ?x - room)
    :precondition (and (ready ?r) (has ?r ?h) (at ?r ?x) (in ?b ?x) (empty ?h))
    :effect (and (not (in ?b ?x)) (not (empty ?h)) (held ?b ?h)))
  (:action put
    :parameters (?r - robot ?h - hand ?b - ball ?x - room)
    :precondition (and (ready ?r) (has ?r ?h) (at ?r ?x) (held ?b ?h))
    :effect (and (not (held ?b ?h)) (empty ?h) (in ?b ?x))))
