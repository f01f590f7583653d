; ROOMS (Borrajo and Veloso 2024, Table 1): one robot fetches objects that lie in rooms. Every room leads into every other.
(define (domain rooms)
  (:requirements :strips :typing)
  (:types room item)
  (:predicates
    (at-robot ?l - room)
    (at-object ?o - item ?l - room)
    (prepared ?o - item)
    (holding ?o - item))

  (:action move
    :parameters (?a ?b - room)
    :precondition (at-robot ?a)
    :effect (and (not (at-robot ?a)) (at-robot ?b)))

  (:action prepare
    :parameters (?o - item ?l - room)
    :precondition (and (at-object ?o ?l) (at-robot ?l))
    :effect (prepared ?o))

  (:action grasp
    :parameters (?o - item ?l - room)
    :precondition (and (at-object ?o ?l) (at-robot ?l) (prepared ?o))
    :effect (and (holding ?o) (not (at-object ?o ?l)))))
