"""People without a screen: what they are told and what they say, lamps, sounds, what stops."""
