; What this detector can find.
(define (problem people-detector)
  (:domain people-detector)
  (:objects person - class)
  (:init (recognises detector person)))
