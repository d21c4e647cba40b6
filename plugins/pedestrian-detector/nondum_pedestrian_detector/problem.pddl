; What this detector can find.
(define (problem pedestrian-detector)
  (:domain pedestrian-detector)
  (:objects person - class)
  (:init (recognises spotter person)))
