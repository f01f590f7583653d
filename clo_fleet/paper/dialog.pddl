; DIALOG: one robot walks up to people and asks each of them its questions, in their order. Each person stands in a place
; of their own. `(depends ?q ?before)`: ?q may be asked of somebody who has answered ?before. A first question counts as
; asked; the paper names neither it nor the parameters of `ask`.
(define (domain dialog)
  (:requirements :strips :typing)
  (:types place human question)
  (:predicates
    (at-robot ?l - place)
    (at-human ?h - human ?l - place)
    (asked ?h - human ?q - question)
    (depends ?q ?before - question))

  (:action move
    :parameters (?a ?b - place)
    :precondition (at-robot ?a)
    :effect (and (not (at-robot ?a)) (at-robot ?b)))

  (:action ask
    :parameters (?h - human ?q ?before - question ?l - place)
    :precondition (and (at-robot ?l) (at-human ?h ?l) (depends ?q ?before) (asked ?h ?before))
    :effect (asked ?h ?q)))
