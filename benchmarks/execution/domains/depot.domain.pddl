; Hoists stack crates on pallets, trucks carry them.
(define (domain depot)
  (:types hoist truck - machine  crate pallet - surface  machine surface place - object)
  (:predicates (ready ?m - machine) (at ?t - truck ?x - place) (works ?h - hoist ?x - place)
               (stands ?s - surface ?x - place) (on ?c - crate ?s - surface)
               (in ?c - crate ?t - truck) (lifts ?h - hoist ?c - crate) (free ?h - hoist)
               (clear ?s - surface))
  (:action drive
    :parameters (?t - truck ?from - place ?to - place)
    :precondition (and (ready ?t) (at ?t ?from) (not (= ?from ?to)))
    :effect (and (not (at ?t ?from)) (at ?t ?to)))
  (:action lift
    :parameters (?h - hoist ?c - crate ?s - surface ?x - place)
    :precondition (and (ready ?h) (works ?h ?x) (free ?h) (stands ?c ?x) (on ?c ?s) (clear ?c))
    :effect (and (not (stands ?c ?x)) (not (on ?c ?s)) (not (clear ?c)) (not (free ?h))
                 (lifts ?h ?c) (clear ?s)))
  (:action lower
    :parameters (?h - hoist ?c - crate ?s - surface ?x - place)
    :precondition (and (ready ?h) (works ?h ?x) (stands ?s ?x) (clear ?s) (lifts ?h ?c)
                       (not (= ?c ?s)))
    :effect (and (not (lifts ?h ?c)) (not (clear ?s)) (free ?h) (stands ?c ?x) (on ?c ?s)
                 (clear ?c)))
  (:action load
    :parameters (?h - hoist ?c - crate ?t - truck ?x - place)
    :precondition (and (ready ?h) (works ?h ?x) (at ?t ?x) (lifts ?h ?c))
    :effect (and (not (lifts ?h ?c)) (free ?h) (in ?c ?t)))
  (:action unload
    :parameters (?h - hoist ?c - crate ?t - truck ?x - place)
    :precondition (and (ready ?h) (works ?h ?x) (at ?t ?x) (free ?h) (in ?c ?t))
    :effect (and (not (in ?c ?t)) (not (free ?h)) (lifts ?h ?c))))
