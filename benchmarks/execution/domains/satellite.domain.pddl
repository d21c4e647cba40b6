; Satellites turn, calibrate their instruments and take pictures.
(define (domain satellite)
  (:types satellite instrument direction mode)
  (:predicates (ready ?s - satellite) (on-board ?i - instrument ?s - satellite)
               (supports ?i - instrument ?m - mode) (target ?i - instrument ?d - direction)
               (power ?s - satellite) (powered ?i - instrument) (calibrated ?i - instrument)
               (pointing ?s - satellite ?d - direction) (image ?d - direction ?m - mode))
  (:action turn
    :parameters (?s - satellite ?to - direction ?from - direction)
    :precondition (and (ready ?s) (pointing ?s ?from) (not (= ?from ?to)))
    :effect (and (not (pointing ?s ?from)) (pointing ?s ?to)))
  (:action switch-on
    :parameters (?s - satellite ?i - instrument)
    :precondition (and (ready ?s) (on-board ?i ?s) (power ?s))
    :effect (and (not (power ?s)) (not (calibrated ?i)) (powered ?i)))
  (:action switch-off
    :parameters (?s - satellite ?i - instrument)
    :precondition (and (ready ?s) (on-board ?i ?s) (powered ?i))
    :effect (and (not (powered ?i)) (power ?s)))
  (:action calibrate
    :parameters (?s - satellite ?i - instrument ?d - direction)
    :precondition (and (ready ?s) (on-board ?i ?s) (powered ?i) (target ?i ?d) (pointing ?s ?d))
    :effect (calibrated ?i))
  (:action photograph
    :parameters (?s - satellite ?i - instrument ?d - direction ?m - mode)
    :precondition (and (ready ?s) (on-board ?i ?s) (powered ?i) (calibrated ?i) (supports ?i ?m)
                       (pointing ?s ?d))
    :effect (image ?d ?m)))
