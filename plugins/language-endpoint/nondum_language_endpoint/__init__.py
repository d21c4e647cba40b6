"""Goals in a person's own words, by a server of language models."""
