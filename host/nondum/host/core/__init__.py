"""What the whole host speaks of: events, effects, records, the state and the bus."""
