"""Has a language model choose the phrase that a person means: what plugins that translate share."""
