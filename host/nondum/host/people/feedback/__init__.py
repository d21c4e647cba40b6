"""What a person is shown who has no screen: one state at a time, by outputs of extensions."""
