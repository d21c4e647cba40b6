"""A charger: it tells when the battery is low, and docks."""
