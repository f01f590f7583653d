; The worked example of Borrajo and Veloso 2024, for the domain in rooms.pddl: two objects, three rooms.
(define (problem worked-example)
  (:domain rooms)
  (:objects l1 l2 l3 - room o1 o2 - item)
  (:init (at-robot l3) (at-object o1 l1) (at-object o2 l2))
  (:goal (and (holding o1) (holding o2))))
