; What one robot of the fleet can do. A robot plans with its own actions only: `self` is true of the planning robot.
; Places are rooms and corridor zones; `connected` leads into rooms only, so a zone can only be where a plan starts.
; `meets ?q ?l` says that robot ?q will come by room ?l according to the plan that it announced.
; Costs are whole tenths of a second; the task supplies their values.
(define (domain fleet)
  (:requirements :strips :typing :action-costs)
  (:types robot item place)
  (:predicates
    (self ?r - robot)
    (room ?l - place)
    (connected ?a ?b - place)
    (meets ?q - robot ?l - place)
    (at-robot ?r - robot ?l - place)
    (at-object ?o - item ?l - place)
    (prepared ?o - item)
    (holding ?r - robot ?o - item))
  (:functions
    (total-cost)
    (travel-time ?a ?b - place)
    (prepare-time)
    (grasp-time)
    (place-time)
    (give-time) - number)

  (:action move
    :parameters (?r - robot ?a ?b - place)
    :precondition (and (self ?r) (connected ?a ?b) (at-robot ?r ?a))
    :effect (and (not (at-robot ?r ?a)) (at-robot ?r ?b) (increase (total-cost) (travel-time ?a ?b))))

  (:action prepare
    :parameters (?r - robot ?o - item ?l - place)
    :precondition (and (self ?r) (room ?l) (at-object ?o ?l) (at-robot ?r ?l))
    :effect (and (prepared ?o) (increase (total-cost) (prepare-time))))

  (:action grasp
    :parameters (?r - robot ?o - item ?l - place)
    :precondition (and (self ?r) (room ?l) (at-object ?o ?l) (at-robot ?r ?l) (prepared ?o))
    :effect (and (holding ?r ?o) (not (at-object ?o ?l)) (increase (total-cost) (grasp-time))))

  (:action place
    :parameters (?r - robot ?o - item ?l - place)
    :precondition (and (self ?r) (room ?l) (holding ?r ?o) (at-robot ?r ?l))
    :effect (and (at-object ?o ?l) (not (holding ?r ?o)) (increase (total-cost) (place-time))))

  (:action give
    :parameters (?r ?q - robot ?o - item ?l - place)
    :precondition (and (self ?r) (room ?l) (holding ?r ?o) (at-robot ?r ?l) (meets ?q ?l))
    :effect (and (holding ?q ?o) (not (holding ?r ?o)) (increase (total-cost) (give-time)))))
