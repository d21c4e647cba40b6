"""A GPS receiver that speaks NMEA 0183 over a serial line."""
