"""Pedestrians in images, by the detector that Daimler trained for cars."""
