; COOKING as a fleet: cooks fetch ingredients into a kitchen and cut them, a unit at a time. Ingredients have sizes: a
; cut of ?i from ?n to ?m units is possible if `(cut-of ?i ?n ?m)`. `(has-cut ?i ?n)` says at least ?n units, and stays.
(define (domain cooking)
  (:requirements :strips :typing)
  (:types robot ingredient room amount)
  (:predicates
    (self ?r - robot)
    (way ?a ?b - room)
    (kitchen ?l - room)
    (at-robot ?r - robot ?l - room)
    (at-ingredient ?i - ingredient ?l - room)
    (has ?r - robot ?i - ingredient)
    (cut-of ?i - ingredient ?n ?m - amount)
    (has-cut ?i - ingredient ?n - amount))

  (:action move
    :parameters (?r - robot ?a ?b - room)
    :precondition (and (self ?r) (way ?a ?b) (at-robot ?r ?a))
    :effect (and (not (at-robot ?r ?a)) (at-robot ?r ?b)))

  (:action get
    :parameters (?r - robot ?i - ingredient ?l - room)
    :precondition (and (self ?r) (at-robot ?r ?l) (at-ingredient ?i ?l))
    :effect (and (has ?r ?i) (not (at-ingredient ?i ?l))))

  (:action put
    :parameters (?r - robot ?i - ingredient ?l - room)
    :precondition (and (self ?r) (at-robot ?r ?l) (has ?r ?i))
    :effect (and (at-ingredient ?i ?l) (not (has ?r ?i))))

  (:action cut
    :parameters (?r - robot ?i - ingredient ?n ?m - amount ?l - room)
    :precondition (and (self ?r) (kitchen ?l) (at-robot ?r ?l) (at-ingredient ?i ?l) (cut-of ?i ?n ?m) (has-cut ?i ?n))
    :effect (has-cut ?i ?m)))
