; Trucks inside cities, an aeroplane between their airports.
(define (domain logistics)
  (:types truck plane - vehicle  airport - place  vehicle place parcel city - object)
  (:predicates (ready ?v - vehicle) (within ?x - place ?c - city)
               (stands ?v - vehicle ?x - place) (lies ?p - parcel ?x - place)
               (loaded ?p - parcel ?v - vehicle))
  (:action drive
    :parameters (?v - truck ?from - place ?to - place ?c - city)
    :precondition (and (ready ?v) (stands ?v ?from) (within ?from ?c) (within ?to ?c)
                       (not (= ?from ?to)))
    :effect (and (not (stands ?v ?from)) (stands ?v ?to)))
  (:action fly
    :parameters (?v - plane ?from - airport ?to - airport)
    :precondition (and (ready ?v) (stands ?v ?from) (not (= ?from ?to)))
    :effect (and (not (stands ?v ?from)) (stands ?v ?to)))
  (:action load
    :parameters (?v - vehicle ?p - parcel ?x - place)
    :precondition (and (ready ?v) (stands ?v ?x) (lies ?p ?x))
    :effect (and (not (lies ?p ?x)) (loaded ?p ?v)))
  (:action unload
    :parameters (?v - vehicle ?p - parcel ?x - place)
    :precondition (and (ready ?v) (stands ?v ?x) (loaded ?p ?v))
    :effect (and (not (loaded ?p ?v)) (lies ?p ?x))))
