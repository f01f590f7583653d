; COOKING: one robot cuts given amounts of ingredients, a unit at a time. `(has-cut ?i ?n)`: at least ?n units of ?i are cut.
; `next`, which the paper leaves out, counts.
(define (domain cooking)
  (:requirements :strips :typing)
  (:types ingredient amount)
  (:predicates
    (has-ingredient ?i - ingredient)
    (has-cut ?i - ingredient ?n - amount)
    (next ?n ?m - amount))

  (:action get
    :parameters (?i - ingredient)
    :precondition ()
    :effect (has-ingredient ?i))

  (:action cut
    :parameters (?i - ingredient ?n ?m - amount)
    :precondition (and (has-ingredient ?i) (has-cut ?i ?n) (next ?n ?m))
    :effect (has-cut ?i ?m)))
