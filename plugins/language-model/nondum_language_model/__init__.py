"""Goals in a person's own words, by a language model that the operator brings."""
