"""The component manager: commits decisions, carries their effects out, and starts safely."""
