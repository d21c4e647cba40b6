"""Extensions of the host itself: what they can add, and how they are found."""
