"""How payloads come to life on a host and leave it: the component manager and its executor."""
