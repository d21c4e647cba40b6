"""From the fragments of fifty strangers to a plan that runs, and what one more costs."""
