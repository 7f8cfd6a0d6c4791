"""From strips to vehicles: who is offered which strip."""
