"""What a person is shown who has no screen: one state at a time, by lamps, sounds and a hook."""
