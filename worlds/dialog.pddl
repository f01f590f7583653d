; DIALOG as a fleet: robots walk up to people and ask them questions, each person in the order of the questions.
; `(follows ?q ?before)`: ?q may be asked of somebody who has answered ?before; everybody has answered `hello`.
; No costs: a drive takes what the map says, a question what the world file says.
(define (domain dialog)
  (:requirements :strips :typing)
  (:types robot person room question)
  (:predicates
    (self ?r - robot)
    (way ?a ?b - room)
    (at-robot ?r - robot ?l - room)
    (at-person ?p - person ?l - room)
    (follows ?q ?before - question)
    (answered ?p - person ?q - question))

  (:action move
    :parameters (?r - robot ?a ?b - room)
    :precondition (and (self ?r) (way ?a ?b) (at-robot ?r ?a))
    :effect (and (not (at-robot ?r ?a)) (at-robot ?r ?b)))

  (:action ask
    :parameters (?r - robot ?p - person ?q ?before - question ?l - room)
    :precondition (and (self ?r) (at-robot ?r ?l) (at-person ?p ?l) (follows ?q ?before) (answered ?p ?before))
    :effect (answered ?p ?q)))
