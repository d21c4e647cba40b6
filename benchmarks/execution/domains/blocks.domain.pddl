; An arm builds towers of blocks.
(define (domain blocks)
  (:types arm block)
  (:predicates (ready ?a - arm) (empty ?a - arm) (held ?b - block ?a - arm) (clear ?b - block)
               (on ?b - block ?c - block) (on-table ?b - block))
  (:action pick-up
    :parameters (?a - arm ?b - block)
    :precondition (and (ready ?a) (empty ?a) (clear ?b) (on-table ?b))
    :effect (and (not (empty ?a)) (not (clear ?b)) (not (on-table ?b)) (held ?b ?a)))
  (:action put-down
    :parameters (?a - arm ?b - block)
    :precondition (and (ready ?a) (held ?b ?a))
    :effect (and (not (held ?b ?a)) (empty ?a) (clear ?b) (on-table ?b)))
  (:action stack
    :parameters (?a - arm ?b - block ?c - block)
    :precondition (and (ready ?a) (held ?b ?a) (clear ?c) (not (= ?b ?c)))
    :effect (and (not (held ?b ?a)) (not (clear ?c)) (empty ?a) (clear ?b) (on ?b ?c)))
  (:action unstack
    :parameters (?a - arm ?b - block ?c - block)
    :precondition (and (ready ?a) (empty ?a) (clear ?b) (on ?b ?c))
    :effect (and (not (on ?b ?c)) (not (empty ?a)) (not (clear ?b)) (held ?b ?a) (clear ?c))))
