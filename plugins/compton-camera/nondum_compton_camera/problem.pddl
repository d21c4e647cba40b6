; What this camera can find.
(define (problem compton-camera)
  (:domain compton-camera)
  (:objects radiation-source - target)
  (:init (senses gamma-eye radiation-source)))
