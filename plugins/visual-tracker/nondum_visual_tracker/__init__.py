"""Follow one person: detections in, velocities out."""
